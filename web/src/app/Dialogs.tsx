import { lazy, Suspense, useState } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { answer, useQuestion } from "./asking";
import { Sheet } from "./controls";
import { Fence } from "./Fence";
import { tell } from "./telling";

const DIALOGS = {
  upload: async () => ({ default: (await import("../upload/UploadDialog")).UploadDialog }),
  library: async () => ({ default: (await import("../projects/LibraryDialog")).LibraryDialog }),
  examples: async () => ({ default: (await import("../projects/ExamplesDialog")).ExamplesDialog }),
  share: async () => ({ default: (await import("../projects/ShareDialog")).ShareDialog }),
  help: async () => ({ default: (await import("./HelpDialog")).HelpDialog }),
};

export type DialogName = keyof typeof DIALOGS;

/** Fetched when it is opened; anew each time, so that a failure isn't remembered. */
function Fetched({ name, onClose }: { name: DialogName; onClose: () => void }) {
  const [Open] = useState(() => lazy(DIALOGS[name]));
  return (
    <Suspense>
      <Open onClose={onClose} />
    </Suspense>
  );
}

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
  const fail = () => {
    tell(t("server.needed"), "warning");
    onClose();
  };
  return (
    <>
      <Fence key={open} onFailure={fail}>
        {open && <Fetched name={open} onClose={onClose} />}
      </Fence>
      <Asking />
    </>
  );
}
