import { Button } from "react-aria-components";
import type { Diagnostic } from "../api/types";
import { inLanguage } from "../i18n";
import { classes } from "../ui/classes";
import { applyFix } from "./fixes";
import buttons from "../ui/buttons.module.css";

/** A button for each value that would fix a wrong block. */
export function FixButtons({ diagnostic }: { diagnostic: Diagnostic }) {
  return (diagnostic.fixes ?? []).map((each) => (
    <Button key={`${each.field} ${each.value}`} className={classes(buttons.button, buttons.primary)} onPress={() => applyFix(diagnostic, each)}>
      {inLanguage(each.sentence)}
    </Button>
  ));
}
