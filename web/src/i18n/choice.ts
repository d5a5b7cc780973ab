/** The language that was chosen for this browser; the studio and the remote speak the same. */

const KEPT = "motorcade.language";

/** Of those that there are: the one that was chosen, else the browser's first. Pages say it to screen readers. */
export function firstLanguage(languages: readonly string[]): string {
  const wished = [localStorage.getItem(KEPT), ...navigator.languages].map((tag) => tag?.split("-")[0] ?? "");
  const first = wished.find((tag) => languages.includes(tag)) ?? "en";
  document.documentElement.lang = first;
  return first;
}

export function keepLanguage(language: string): void {
  localStorage.setItem(KEPT, language);
  document.documentElement.lang = language;
}
