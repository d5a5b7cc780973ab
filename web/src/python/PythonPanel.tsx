import { lazy, useEffect } from "react";
import { FixButtons } from "../blocks/fixes";
import { inLanguage, useTexts } from "../i18n";
import { Later } from "../ui/panes";
import { classes } from "../ui/classes";
import { TextButton } from "../ui/controls";
import { followBlocks, updateText, usePython } from "./text";
import css from "./python.module.css";

const CodeEditor = lazy(() => import("./CodeEditor"));
const FunctionList = lazy(() => import("./FunctionList"));

/** What is wrong with the text, in words: screen readers announce it. */
function Mistakes() {
  const t = useTexts();
  const diagnostics = usePython((python) => python.diagnostics);
  // The text can't be read: the blocks keep what they were.
  const mistaken = diagnostics.some(({ severity }) => severity === "error");
  return (
    <div className={css.mistakes} role="status">
      {diagnostics.slice(0, 3).map((diagnostic, index) => (
        <p key={index} data-severity={diagnostic.severity}>
          {diagnostic.place && <b>{t("python.line", { line: diagnostic.place.line })}</b>} {inLanguage(diagnostic.sentence)}{" "}
          <FixButtons diagnostic={diagnostic} />
        </p>
      ))}
      {mistaken && (
        <p className={css.kept}>
          {t("python.blocksCount")}{" "}
          <TextButton link onPress={() => void updateText(true)}>{t("python.writeAnew")}</TextButton>
        </p>
      )}
    </div>
  );
}

/** The program as Python text, beside the blocks; each follows the other. */
export function PythonPanel() {
  const t = useTexts();
  useEffect(followBlocks, []);
  return (
    <div className="column flush fill">
      <p id="python-about" className={classes("quiet", css.about)}>
        {t("python.about")}
      </p>
      <Later waiting={<p className="quiet">{t("app.loading")}</p>}>
        <div className={css.beside}>
          <FunctionList />
          <CodeEditor />
        </div>
      </Later>
      <Mistakes />
    </div>
  );
}
