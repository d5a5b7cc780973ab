import { Button } from "react-aria-components";
import type { Diagnostic } from "../api/types";
import { inLanguage } from "../i18n";
import { classes } from "../ui/classes";
import { mend } from "./mends";
import buttons from "../ui/buttons.module.css";

/** A button for each value that would mend a wrong block. */
export function MendButtons({ diagnostic }: { diagnostic: Diagnostic }) {
  return (diagnostic.mends ?? []).map((each) => (
    <Button key={`${each.field} ${each.value}`} className={classes(buttons.button, buttons.primary)} onPress={() => mend(diagnostic, each)}>
      {inLanguage(each.sentence)}
    </Button>
  ));
}
