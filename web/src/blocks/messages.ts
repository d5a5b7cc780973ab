/** Blockly's own messages in the page's language; what its files lack stands in ours under `blockly`. */

import * as Blockly from "blockly/core";
import i18next from "i18next";
import type { Language } from "../api/types";

const ENGLISH = () => import("blockly/msg/en");
const FILES: Partial<Record<Language, () => Promise<unknown>>> = { zh: () => import("blockly/msg/zh-hans") };

export async function speakBlockly(language: Language): Promise<void> {
  const messages = (await (FILES[language] ?? ENGLISH)()) as Record<string, string>;
  Blockly.setLocale({ ...messages, ...i18next.getResource(language, "translation", "blockly") as object });
}
