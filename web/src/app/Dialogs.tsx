import { lazy, Suspense } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { answer, useQuestion } from "./asking";
import { Sheet } from "./controls";
import { Fence, reload } from "./Fence";
import { tell } from "./telling";

const DIALOGS = {
  upload: lazy(async () => ({ default: (await import("../upload/UploadDialog")).UploadDialog })),
  library: lazy(async () => ({ default: (await import("../projects/LibraryDialog")).LibraryDialog })),
  examples: lazy(async () => ({ default: (await import("../projects/ExamplesDialog")).ExamplesDialog })),
  share: lazy(async () => ({ default: (await import("../projects/ShareDialog")).ShareDialog })),
  help: lazy(async () => ({ default: (await import("./HelpDialog")).HelpDialog })),
};

export type DialogName = keyof typeof DIALOGS;

function Asking() {
  const { t } = useTranslation();
  const question = useQuestion((state) => state.question);
  if (!question) return null;
  return (
    <Sheet title={question.title} onClose={() => answer(false)} role="alertdialog">
      <p>{question.text}</p>
      <footer className="sheet-foot">
        <Button className="button" autoFocus onPress={() => answer(false)}>
          {t("app.cancel")}
        </Button>
        <Button className="button primary" onPress={() => answer(true)}>
          {question.yes}
        </Button>
      </footer>
    </Sheet>
  );
}

/** The dialog that is open, and the question above it. One that can't be fetched, as while the server is away, is not. */
export function Dialogs({ open, onClose }: { open: DialogName | null; onClose: () => void }) {
  const { t } = useTranslation();
  const Open = open && DIALOGS[open];
  const fail = () => {
    tell(t("app.failed"), "error", { label: t("app.reload"), run: reload });
    onClose();
  };
  return (
    <>
      <Fence key={open} onFailure={fail}>
        <Suspense>{Open && <Open onClose={onClose} />}</Suspense>
      </Fence>
      <Asking />
    </>
  );
}
