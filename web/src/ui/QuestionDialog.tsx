import { useTexts } from "../i18n";
import { useQuestion } from "../state/questions";
import { Sheet, TextButton } from "./controls";
import controls from "./controls.module.css";

/** The question that the page asks, above everything else. */
export default function QuestionDialog() {
  const t = useTexts();
  const question = useQuestion((state) => state.question);
  if (!question) return null;
  return (
    <Sheet title={question.title} onClose={() => question.answer("no")} role="alertdialog">
      <p>{question.text}</p>
      <footer className={controls.sheetFoot}>
        <TextButton autoFocus onPress={() => question.answer("no")}>{t("app.cancel")}</TextButton>
        {question.other && (
          <TextButton onPress={() => question.answer("other")}>{question.other}</TextButton>
        )}
        <TextButton primary onPress={() => question.answer("yes")}>{question.yes}</TextButton>
      </footer>
    </Sheet>
  );
}
