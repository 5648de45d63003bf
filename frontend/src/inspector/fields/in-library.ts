/** Whether a form is of an action of the library: nothing gives its values, and nothing has to be filled in. */
import { createContext, use } from "react";

export const InLibraryContext = createContext(false);

export const useInLibrary = (): boolean => use(InLibraryContext);
