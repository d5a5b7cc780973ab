import { useCallback, useEffect, useState } from "react";
import { Button, Label, ProgressBar, RadioButton, RadioField, RadioGroup } from "react-aria-components";
import { useTranslation } from "react-i18next";
import * as api from "../api/http";
import type { Port } from "../api/types";
import { Check, Sheet } from "../app/controls";
import { useSettings } from "../app/settings";
import { useStudio } from "../app/store";
import { inLanguage } from "../i18n";
import { attempt } from "../projects/actions";
import { markUnsaved, replaceBy } from "../projects/opening";
import { Result } from "./Result";
import { CutOffError, transfer, transferBySerial, type Order, type Outcome, type Progress } from "./transfer";
import { hasWebSerial, requestPort } from "./web-serial";

/** The choice that stands for a port of the browser's. */
const BROWSER_PORT = "browser:";
const BAUD = 115_200;

function usePorts() {
  const [ports, setPorts] = useState<Port[]>([]);
  const look = useCallback(() => attempt(async () => setPorts(await api.ports())), []);
  useEffect(() => void look(), [look]);
  return { ports, look };
}

/** The port of last time where it is still there; else the virtual car, which can't do any harm. */
function firstChoice(ports: readonly Port[], lastUsed: string | null): string | null {
  const known = lastUsed === BROWSER_PORT && hasWebSerial() ? { port: lastUsed } : ports.find(({ port }) => port === lastUsed);
  return (known ?? ports.find(({ kind }) => kind === "virtual") ?? ports[0])?.port ?? null;
}

async function send(port: string, order: Order, onProgress: (progress: Progress) => void): Promise<Outcome | null> {
  if (port !== BROWSER_PORT) return transfer(port, order, onProgress);
  const chosen = await requestPort();
  return chosen && transferBySerial(chosen, BAUD, order, onProgress);
}

interface PortChoiceProps {
  ports: Port[];
  chosen: string;
  onChoose: (port: string) => void;
}

function PortChoice({ ports, chosen, onChoose }: PortChoiceProps) {
  const { t } = useTranslation();
  const choices = ports.map(({ port, description, kind }) => ({
    port,
    title: kind === "virtual" ? t("upload.virtual") : port,
    // What pyserial says of a port that tells nothing about itself.
    about: kind === "virtual" ? t("upload.virtualAbout") : description.replace(/^n\/a$/, ""),
  }));
  if (hasWebSerial()) choices.push({ port: BROWSER_PORT, title: t("upload.browser"), about: t("upload.browserAbout") });
  return (
    <RadioGroup value={chosen} onChange={onChoose} className="ports">
      <Label>{t("upload.port")}</Label>
      {choices.map(({ port, title, about }) => (
        <RadioField key={port} value={port}>
          <RadioButton className="port">
            <b>{title}</b>
            <span>{about}</span>
          </RadioButton>
        </RadioField>
      ))}
    </RadioGroup>
  );
}

/** Sends the image to a car, tells what truly became of it, and fetches back what a car holds. */
export function UploadDialog({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const image = useStudio((studio) => studio.compiled?.image ?? null);
  const { ports, look } = usePorts();
  const lastUsed = useSettings((settings) => settings.port);
  const [wished, setWished] = useState<string | null>(null);
  const [verify, setVerify] = useState(true);
  const [progress, setProgress] = useState<Progress | null>(null);
  const [outcome, setOutcome] = useState<Outcome | "cut-off" | null>(null);
  const port = wished ?? firstChoice(ports, lastUsed);

  const run = async (order: Order) => {
    if (port === null) return;
    useSettings.setState({ port });
    setOutcome(null);
    setProgress({ sent: 0, of: 0 });
    try {
      // The reason of the last retry stays while its bytes travel.
      setOutcome(await send(port, order, (next) => setProgress((last) => ({ retry: last?.retry, ...next }))));
    } catch (error) {
      if (!(error instanceof CutOffError)) throw error;
      setOutcome("cut-off");
    } finally {
      setProgress(null);
    }
  };
  const openAsBlocks = (read: string) =>
    attempt(async () => {
      const opened = await api.decompile(read);
      onClose();
      const { mat, rangeMm } = useStudio.getState();
      if (await replaceBy({ ...opened, mat, range_mm: rangeMm })) setTimeout(markUnsaved);
    });

  const busy = progress !== null;
  return (
    <Sheet title={t("upload.title")} onClose={onClose}>
      <PortChoice ports={ports} chosen={port ?? ""} onChoose={setWished} />
      <Button className="link" onPress={() => void look()}>
        {t("upload.look")}
      </Button>
      <Check checked={verify} onChange={setVerify}>
        {t("upload.verify")}
      </Check>
      {progress && (
        <ProgressBar className="progress" value={progress.sent} maxValue={progress.of || 1} isIndeterminate={!progress.of}>
          {({ percentage }) => (
            <>
              <Label>{t(progress.of ? "upload.sending" : "upload.waiting", { sent: progress.sent, of: progress.of })}</Label>
              <span className="progress-bar">
                <span style={{ width: `${percentage ?? 30}%` }} />
              </span>
              {progress.retry && <p className="quiet">{inLanguage(progress.retry.sentence)}</p>}
            </>
          )}
        </ProgressBar>
      )}
      {outcome && <Result outcome={outcome} onOpen={(read) => void openAsBlocks(read)} />}
      {!image && <p className="quiet">{t("upload.noImage")}</p>}
      {/* A button that is disabled under the finger would drop the focus out of the dialog: these only wait. */}
      <footer className="sheet-foot">
        <Button className="button" isPending={busy} isDisabled={port === null} onPress={() => void run({ readback: true })}>
          {t("upload.readBack")}
        </Button>
        <Button
          className="button primary"
          isPending={busy}
          isDisabled={port === null || !image}
          onPress={() => image && void run({ image, verify })}
        >
          {t("upload.send")}
        </Button>
      </footer>
    </Sheet>
  );
}
