/** The forms of what can be selected, which are loaded together. */
export { ActionForm } from "./action-form";
export { NoteForm } from "./note-form";
export { RelationForm } from "./relation-form";
export { SeveralForm } from "./robot-field";
export { RunConditions } from "./run-conditions";
