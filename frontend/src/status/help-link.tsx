/** Leads to a place of the documentation, beside the page: that keeps STOP. */
import { helpUrl } from "../api/page-url";
import style from "./help-link.module.css";

interface Props {
  /** A test looks that the documentation has it. */
  place: string;
  words?: string;
}

export function HelpLink({ place, words = "Help" }: Props) {
  return (
    <a className={style.link} href={helpUrl(place)} target="_blank" rel="noopener">
      {words}
    </a>
  );
}
