import { type ReactNode, useCallback, useEffect, useState } from "react";
import { Label, ProgressBar, RadioButton, RadioField, RadioGroup } from "react-aria-components";
import { request } from "../api/service";
import type { Port } from "../api/types";
import { CarList } from "../cars/CarList";
import { Check, Sheet, TextButton } from "../ui/controls";
import { closeDialog } from "../state/dialogs";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { inLanguage, useTexts } from "../i18n";
import { attempt } from "../projects/actions";
import { markUnsaved, replaceBy } from "../projects/project";
import { usePupil } from "../pupil/store";
import { CutOffError, hasWebSerial, PortBusyError, requestPort, transfer, transferBySerial } from "./transfer";
import type { Order, Outcome, Progress } from "./transfer";
import { Icon } from "../ui/icons";
import controls from "../ui/controls.module.css";
import { classes } from "../ui/classes";
import css from "../app/dialogs.module.css";

/** The value of the choice 'a port of this browser'. */
const BROWSER_PORT = "browser:";
const BAUD = 115_200;

/** The ports of the service, its serial ones only where it can upload through them. */
function usePorts(hasSerial: boolean) {
  const [ports, setPorts] = useState<Port[]>([]);
  const look = useCallback(() => attempt(async () => setPorts(await request("ports"))), []);
  // In a class the computer's ports are there for who has the cable.
  const hasCable = usePupil(({ view }) => view?.shared[0]?.holder === view?.me.id);
  useEffect(() => void look(), [look, hasCable]);
  return { ports: ports.filter(({ kind }) => hasSerial || kind !== "serial"), look };
}

/** The port of the last upload if it still exists; else the simulated car, which can do no harm. */
function firstChoice(ports: readonly Port[], lastUsed: string | null): string | null {
  const known = lastUsed === BROWSER_PORT && hasWebSerial() ? { port: lastUsed } : ports.find(({ port }) => port === lastUsed);
  return (known ?? ports.find(({ kind }) => kind === "virtual") ?? ports[0])?.port ?? null;
}

async function send(port: string, order: Order, onProgress: (progress: Progress) => void): Promise<Outcome | null> {
  if (port !== BROWSER_PORT) return transfer(port, order, onProgress);
  const chosen = await requestPort();
  return chosen && transferBySerial(chosen, BAUD, order, onProgress);
}

function PortChoice({ ports, chosen, onChoose }: { ports: Port[]; chosen: string; onChoose: (port: string) => void }) {
  const t = useTexts();
  const choices = ports.map(({ port, description, kind }) => ({
    port,
    title: kind === "virtual" ? t("upload.virtual") : port,
    // Pyserial describes a port without a description as n/a.
    about: kind === "virtual" ? t("upload.virtualAbout") : description.replace(/^n\/a$/, ""),
  }));
  if (hasWebSerial()) choices.push({ port: BROWSER_PORT, title: t("upload.browser"), about: t("upload.browserAbout") });
  return (
    <RadioGroup value={chosen} onChange={onChoose} className="column">
      <Label>{t("upload.port")}</Label>
      {choices.map(({ port, title, about }) => (
        <RadioField key={port} value={port}>
          <RadioButton className={classes("pick", css.port)}>
            <b>{title}</b>
            <span className="quiet small">{about}</span>
          </RadioButton>
        </RadioField>
      ))}
    </RadioGroup>
  );
}

/** Send the image to a car or several, or read a car's image back, and show the outcome. */
export function UploadDialog() {
  const t = useTexts();
  const path = useStudio((studio) => studio.capabilities?.cars ?? "");
  const image = useStudio((studio) => studio.compiled?.image ?? null);
  const program = useStudio((studio) => studio.name);
  const [several, setSeveral] = useState(false);
  return (
    <Sheet title={t("upload.title")} wide={several}>
      {path && (
        <RadioGroup value={several ? "several" : "one"} onChange={(chosen) => setSeveral(chosen === "several")} aria-label={t("upload.title")} className="row">
          <Kind value="one">{t("upload.oneCar")}</Kind>
          <Kind value="several">{t("upload.manyCars")}</Kind>
        </RadioGroup>
      )}
      {several ? <CarList path={path} image={image} program={program} /> : <OneCar image={image} />}
      {!path && <p className="quiet">{t("upload.noCars")}</p>}
    </Sheet>
  );
}

function Kind({ value, children }: { value: string; children: string }) {
  return (
    <RadioField value={value}>
      <RadioButton className="pick">{children}</RadioButton>
    </RadioField>
  );
}

/** Send an image to a car at a port; unless it is `brief`, read a car's image back too. */
export function OneCar({ image, brief = false }: { image: string | null; brief?: boolean }) {
  const t = useTexts();
  const hasSerial = useStudio((studio) => studio.capabilities?.serial_ports ?? false);
  const { ports, look } = usePorts(hasSerial);
  const lastUsed = useSettings((settings) => settings.port);
  const [wished, setWished] = useState<string | null>(null);
  const [verify, setVerify] = useState(true);
  const [progress, setProgress] = useState<Progress | null>(null);
  const [outcome, setOutcome] = useState<Outcome | Fault | null>(null);
  const port = wished ?? firstChoice(ports, lastUsed);

  const run = async (order: Order) => {
    if (port === null) return;
    useSettings.setState({ port });
    setOutcome(null);
    setProgress({ sent: 0, of: 0 });
    try {
      // The reason of the last retry stays while its bytes travel.
      const result = await send(port, order, (next) => setProgress((last) => ({ retry: last?.retry, ...next })));
      setOutcome(result);
      const arrived = result?.outcome === "verified" || result?.outcome === "not-verified";
      const isCar = ports.find((each) => each.port === port)?.kind !== "virtual";
      if (arrived && isCar) useSettings.setState({ uploaded: true });
    } catch (error) {
      if (error instanceof CutOffError) setOutcome("cutOff");
      else if (error instanceof PortBusyError) setOutcome("portBusy");
      else throw error;
    } finally {
      setProgress(null);
    }
  };
  const openAsBlocks = (read: string) =>
    attempt(async () => {
      const opened = await request("decompile", { image: read });
      closeDialog();
      const { mat, rangeMm, car } = useStudio.getState();
      if (await replaceBy({ ...opened, mat, range_mm: rangeMm, car })) setTimeout(markUnsaved);
    });

  const busy = progress !== null;
  return (
    <>
      <PortChoice ports={ports} chosen={port ?? ""} onChoose={setWished} />
      {!hasSerial && !hasWebSerial() && <p className="quiet">{t(isSecureContext ? "upload.noSerial" : "upload.noSerialByHttp")}</p>}
      {hasSerial && (
        <TextButton link onPress={() => void look()}>{t("upload.look")}</TextButton>
      )}
      {!brief && (
        <Check checked={verify} onChange={setVerify}>
          {t("upload.verify")}
        </Check>
      )}
      {progress && (
        <ProgressBar value={progress.sent} maxValue={progress.of || 1} isIndeterminate={!progress.of}>
          {({ percentage }) => (
            <>
              <Label>{t(progress.of ? "upload.sending" : "upload.waiting", { sent: progress.sent, of: progress.of })}</Label>
              <span className="gauge">
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
      <footer className={controls.sheetFoot}>
        {!brief && (
          <TextButton isPending={busy} isDisabled={port === null} onPress={() => void run({ readback: true })}>
            {t("upload.readBack")}
          </TextButton>
        )}
        <TextButton
          primary={!brief}
          isPending={busy}
          isDisabled={port === null || !image}
          onPress={() => image && void run({ image, verify })}
        >
          {t("upload.send")}
        </TextButton>
      </footer>
    </>
  );
}

/** What kept the service from an outcome: the key of its text. */
type Fault = "cutOff" | "portBusy";

/** The outcome of a transfer. */
function Result({ outcome, onOpen }: { outcome: Outcome | Fault; onOpen: (image: string) => void }) {
  const t = useTexts();
  if (typeof outcome === "string") return <ResultBox tone="error" title={t("upload.failed")}>{t(`upload.${outcome}`)}</ResultBox>;
  switch (outcome.outcome) {
    case "verified":
      return <ResultBox tone="success" title={t("upload.verified")}>{outcome.answer}</ResultBox>;
    case "not-verified":
      return <ResultBox tone="warning" title={t("upload.notVerified")}>{t("upload.notVerifiedAbout")}</ResultBox>;
    case "failed":
      return <ResultBox tone="error" title={t("upload.failed")}>{inLanguage(outcome.error.sentence)}</ResultBox>;
    case "image":
      return (
        <ResultBox tone="success" title={t("upload.read", { words: Math.floor((outcome.image.length * 3) / 16) })}>
          <TextButton small onPress={() => onOpen(outcome.image)}>{t("upload.openAsBlocks")}</TextButton>
        </ResultBox>
      );
  }
}

function ResultBox({ tone, title, children }: { tone: "success" | "warning" | "error"; title: string; children: ReactNode }) {
  return (
    <div className={css.result} data-tone={tone} role={tone === "error" ? "alert" : "status"}>
      <Icon name={tone === "success" ? "done" : tone} />
      <div className="column fill">
        <b>{title}</b>
        {typeof children === "string" ? <p>{children}</p> : children}
      </div>
    </div>
  );
}
