/** Blockly's own messages in the page's language; what its files lack stands in ours under `blockly`. */

import * as Blockly from "blockly/core";
import i18next from "i18next";
import type { Language } from "../api/types";

const ENGLISH = () => import("blockly/msg/en");
/** A language that isn't here has all of Blockly's messages in its own file. */
const FILES: Partial<Record<Language, () => Promise<unknown>>> = { en: ENGLISH, zh: () => import("blockly/msg/zh-hans") };

export async function blocklyMessages(language: Language): Promise<Record<string, string>> {
  const messages = (await FILES[language]?.()) as Record<string, string> | undefined;
  return { ...messages, ...(i18next.getResource(language, "translation", "blockly") as Record<string, string>) };
}

export async function speakBlockly(language: Language): Promise<void> {
  Blockly.setLocale(await blocklyMessages(language));
}
