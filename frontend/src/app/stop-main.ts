/** First entry of the page: STOP, before and apart from everything else. */
import "../ui/tokens.css";
import { pageLink } from "../api/page-link";
import { isViewPage } from "../api/page-url";
import { credentialIn, rememberedPerson } from "../api/session";
import { outliveOutsideChanges } from "../runs/stop/outside-changes";
import { mountStop } from "../runs/stop/stop-root";
import { changedFromOutside, pageError } from "../runs/stop/stop-surroundings";

outliveOutsideChanges(() => changedFromOutside.set(true));
const place = document.getElementById("stop");
if (place === null) throw new Error("index.html has no #stop");
if (isViewPage) {
  // Whoever looks by a link is no person, and stops nothing: the page says where Stop is (decision 125).
  // Only a page that broke is said there.
  for (const name of ["role", "aria-label"]) place.removeAttribute(name);
  mountStop(place);
} else {
  mountStop(place);
  // Who was here last is here still, as far as anybody knows: the page says otherwise once it has asked.
  // A link in the address signs somebody in first.
  const person = rememberedPerson();
  if (person !== null && credentialIn(location.hash) === null) {
    pageLink.enter(person, 1);
  }
}

/**
 * Return whether the page has rendered anything: its first rendering removes the text of
 * index.html.
 */
const isDrawn = () => document.querySelector("#root > .unloaded") === null;

document.getElementById("page-script")?.addEventListener("error", () => {
  pageError.set("Parts of the page did not load: the server does not answer, or it was updated.");
});
window.addEventListener("error", ({ message }) => {
  if (!isDrawn()) pageError.set(message);
});
