/** The language that was chosen in this browser; the studio and the remote share it. */

const KEY = "motorcade.language";

/** The language that was chosen before, else the first of the browser's that exists, else English. */
export function preferredLanguage(languages: readonly string[]): string {
  const wanted = [localStorage.getItem(KEY), ...navigator.languages].map((tag) => tag?.split("-")[0] ?? "");
  const first = wanted.find((tag) => languages.includes(tag)) ?? "en";
  // Screen readers choose their voice by this attribute.
  document.documentElement.lang = first;
  return first;
}

export function keepLanguage(language: string): void {
  localStorage.setItem(KEY, language);
  document.documentElement.lang = language;
}
