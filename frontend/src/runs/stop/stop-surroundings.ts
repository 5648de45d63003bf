/**
 * Values that STOP and the page around it share: they are rendered apart, and neither needs the
 * other.
 */
import { Watched } from "../../ui/watched";

/** The graph on screen: its run is the one that Stop means, if it goes. */
export const graphOnScreen = new Watched<string | null>(null);

/** The run about whose rest a person wants to say something. */
export const askedRun = new Watched<string | null>(null);

/**
 * Set while the page can ask a person about a run's rest: it is rendered, and the person may
 * operate robots.
 */
export const mayAnswer = new Watched(false);

/** An error that the page around STOP did not outlive, in its own words; "" while it stands. */
export const pageError = new Watched("");

/** Set when a translation or an extension has changed what the page rendered. */
export const changedFromOutside = new Watched(false);

/** The button itself while it is drawn: whether another script has removed it. */
export const drawnStop = new Watched<HTMLElement | null>(null);
