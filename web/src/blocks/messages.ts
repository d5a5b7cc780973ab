/** Blockly's own messages in the page's language; those that its files lack are in ours under `blockly`. */

import * as Blockly from "blockly/core";
import i18next from "i18next";
import type { Language } from "../api/types";

const FILES: Record<Language, () => Promise<unknown>> = {
  en: () => import("blockly/msg/en"),
  zh: () => import("blockly/msg/zh-hans"),
};

/** All messages that exist in a language. A language without a file of Blockly's has only those of its own file. */
export async function blocklyMessages(language: Language): Promise<Record<string, string>> {
  const messages = (await FILES[language]?.()) as Record<string, string> | undefined;
  return { ...messages, ...(i18next.getResource(language, "translation", "blockly") as Record<string, string>) };
}

/** Give Blockly its messages; what the language lacks stays English. */
export async function setBlocklyLanguage(language: Language): Promise<void> {
  const english = language in FILES ? {} : await blocklyMessages("en");
  Blockly.setLocale({ ...english, ...(await blocklyMessages(language)) });
}
