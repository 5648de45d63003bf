/** The title of the browser's tab. */

import { useEffect } from "react";
import { isolated } from "../words/isolated";

export function useTitle(title: string): void {
  useEffect(() => {
    document.title = `${isolated(title)} · TeMoto Action Assistant`;
  }, [title]);
}
