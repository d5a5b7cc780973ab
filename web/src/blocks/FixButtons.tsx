import type { Diagnostic } from "../api/types";
import { inLanguage } from "../i18n";
import { applyFix } from "./fixes";
import { TextButton } from "../ui/controls";

/** A button for each value that would fix a wrong block. */
export function FixButtons({ diagnostic }: { diagnostic: Diagnostic }) {
  return (diagnostic.fixes ?? []).map((each) => (
    <TextButton key={`${each.field} ${each.value}`} primary onPress={() => applyFix(diagnostic, each)}>
      {inLanguage(each.sentence)}
    </TextButton>
  ));
}
