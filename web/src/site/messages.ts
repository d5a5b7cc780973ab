/** What the pages of the site and its service worker say to each other. */

/** The new build shall take over, unless another page has work. */
export type ToServiceWorker = "take-over";
/** A question, answered with true or false by the port that comes with it; why the new build doesn't take over. */
export type ToPage = "is-idle" | "others-have-work";
