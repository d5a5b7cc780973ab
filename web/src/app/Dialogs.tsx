import { createElement, lazy, Suspense } from "react";
import { useTexts } from "../i18n";
import { closeDialog, type DialogName, notify, useDialogs, dismiss } from "../state/dialogs";
import { ErrorBoundary, reload } from "../ui/panes";
import { IconButton, TextButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import QuestionDialog from "../ui/QuestionDialog";
import { useStudio } from "../state/studio";
import areas from "../ui/areas.module.css";
import dialogs from "./dialogs.module.css";
import { classes } from "../ui/classes";

const projectDialogs = () => import("../projects/ProjectDialogs");
const DIALOGS: Record<DialogName, React.ComponentType> = {
  upload: lazy(async () => ({ default: (await import("../upload/UploadDialog")).UploadDialog })),
  calibration: lazy(async () => ({ default: (await import("../upload/CalibrationDialog")).CalibrationDialog })),
  library: lazy(async () => ({ default: (await projectDialogs()).LibraryDialog })),
  examples: lazy(async () => ({ default: (await projectDialogs()).ExamplesDialog })),
  share: lazy(async () => ({ default: (await projectDialogs()).ShareDialog })),
  missions: lazy(async () => ({ default: (await import("../missions/MissionMap")).MissionMap })),
  notes: lazy(async () => ({ default: (await import("../missions/NotesDialog")).NotesDialog })),
  run: lazy(async () => ({ default: (await import("../timeline/RunSheet")).RunSheet })),
  help: lazy(async () => ({ default: (await import("./HelpDialog")).HelpDialog })),
};

/** The open dialog, and the question above it. A dialog that can't be fetched is closed with a notice. */
export function Dialogs() {
  const t = useTexts();
  const open = useDialogs((state) => state.open);
  const fail = () => {
    notify(t("app.failed"), "error", { label: t("app.reload"), run: reload });
    closeDialog();
  };
  return (
    <>
      <ErrorBoundary key={open} onFailure={fail}>
        {open && <Suspense>{createElement(DIALOGS[open])}</Suspense>}
      </ErrorBoundary>
      <QuestionDialog />
    </>
  );
}

/** Notices in a corner of the page; screen readers read them out. */
export function Notices() {
  const t = useTexts();
  const notices = useDialogs((state) => state.notices);
  return (
    <div className={classes("unprinted column through", dialogs.notices)} role="log" aria-live="polite" aria-label={t("app.notices")}>
      {notices.map(({ id, text, tone, action }) => (
        <div key={id} className={dialogs.notice} data-tone={tone}>
          <span className="fill">{text}</span>
          {action && (
            <TextButton
              small
              onPress={() => {
                dismiss(id);
                action.run();
              }}
            >
              {action.label}
            </TextButton>
          )}
          <IconButton icon="close" label={t("app.dismiss")} onPress={() => dismiss(id)} />
        </div>
      ))}
    </div>
  );
}

export function ServerBanner() {
  const t = useTexts();
  const state = useStudio(({ service }) => service);
  const lacksWebAssembly = state === "failed" && typeof WebAssembly === "undefined";
  const problem = lacksWebAssembly ? "noWebAssembly" : state;
  const text = problem === "ready" || problem === "starting" ? null : t(`server.${problem}`, { host: location.host });
  return (
    <div className="unprinted" role="alert">
      {text && (
        <p className={areas.warning}>
          <Icon name="warning" />
          {text}
        </p>
      )}
    </div>
  );
}
