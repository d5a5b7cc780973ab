import { type CSSProperties, lazy, type MouseEvent, Suspense, useEffect, useState } from "react";
import { Button, I18nProvider, ToggleButton, ToggleButtonGroup } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Editors } from "../blocks/Editors";
import { setBlocklyLanguage, hatOf } from "../blocks/definitions";
import { showBlock, workspaceOf } from "../blocks/workspaces";
import { currentLanguage } from "../i18n";
import { attempt } from "../projects/actions";
import { useSettings } from "../state/settings";
import { useStudio, type View } from "../state/studio";
import { Divider, ErrorBoundary, reload } from "../ui/areas";
import { Icon, type IconName } from "../ui/icons";
import { collectEdits } from "../words/compiling";
import { WordsPanel } from "../words/WordsPanel";
import { Dialogs, Notices, ServerBanner } from "./Dialogs";
import { Header } from "./Header";
import { openEditors, prepare } from "./start";
import { Tour } from "./Tour";
import css from "./app.module.css";
import areas from "../ui/areas.module.css";
import buttons from "../ui/buttons.module.css";
import controls from "../ui/controls.module.css";
import { classes } from "../ui/classes";

const VIEW_ICONS: Record<View, IconName> = { leader: "blocks", followers: "blocks", words: "words", mat: "mat" };

/** On a narrow screen one area shows at a time. */
function Views() {
  const { t } = useTranslation();
  const view = useStudio((studio) => studio.view);
  const followed = useStudio((studio) => studio.followers !== null);
  const views: View[] = followed ? ["leader", "followers", "words", "mat"] : ["leader", "words", "mat"];
  return (
    <nav className={css.views} aria-label={t("app.views")}>
      <ToggleButtonGroup
        aria-label={t("app.views")}
        disallowEmptySelection
        selectedKeys={[view]}
        onSelectionChange={(keys) => useStudio.setState({ view: [...keys][0] as View })}
      >
        {views.map((name) => (
          <ToggleButton key={name} id={name} className={css.view}>
            <Icon name={VIEW_ICONS[name]} />
            {t(`views.${name}`)}
          </ToggleButton>
        ))}
      </ToggleButtonGroup>
    </nav>
  );
}

/** Focus the leader's first block, below which the next one is put. A fragment alone wouldn't move Blockly's focus. */
function focusBlocks(event: MouseEvent): void {
  event.preventDefault();
  showBlock("leader", workspaceOf("leader")?.getBlocksByType(hatOf("leader"))[0]?.id ?? "");
}

function SkipLinks() {
  const { t } = useTranslation();
  return (
    <nav className={css.skipLinks} aria-label={t("app.skip")}>
      <a href="#leader-blocks" onClick={focusBlocks}>
        {t("app.skipBlocks")}
      </a>
      <a href="#words">{t("app.skipWords")}</a>
      <a href="#mat">{t("app.skipMat")}</a>
    </nav>
  );
}

const MatPanel = lazy(async () => ({ default: (await import("../mat/MatPanel")).MatPanel }));

/** The mat, fetched after the rest of the page. */
function MatArea() {
  const { t } = useTranslation();
  const failed = (
    <div className={areas.failed} role="alert">
      <p>{t("app.failed")}</p>
      <Button className={classes(buttons.button, buttons.primary)} onPress={reload}>
        {t("app.reload")}
      </Button>
    </div>
  );
  return (
    <section className={classes(css.matArea, areas.panel)} data-view="mat" id="mat" tabIndex={-1} aria-label={t("mat.title")}>
      <ErrorBoundary fallback={failed}>
        <Suspense fallback={<p className={classes(controls.quiet, areas.loading)}>{t("app.loading")}</p>}>
          <MatPanel />
        </Suspense>
      </ErrorBoundary>
    </section>
  );
}

function Work() {
  const { t } = useTranslation();
  const language = useEditorsLanguage();
  const view = useStudio((studio) => studio.view);
  const shares = useSettings((settings) => settings.shares);
  const share = (changed: Partial<typeof shares>) => useSettings.setState({ shares: { ...shares, ...changed } });
  useEffect(openEditors, []);
  return (
    <main className={css.work} data-view={view} style={{ "--share": shares.page } as CSSProperties}>
      <div className={css.left} style={{ "--share": shares.words } as CSSProperties}>
        <Editors key={language} />
        <Divider label={t("words.divider")} orientation="horizontal" reversed share={shares.words} onShare={(words) => share({ words })} />
        <section className={classes(css.wordsPanel, areas.panel)} data-view="words" id="words" tabIndex={-1} aria-labelledby="words-title">
          <WordsPanel />
        </section>
      </div>
      <Divider label={t("app.divider")} orientation="vertical" share={shares.page} onShare={(page) => share({ page })} />
      <MatArea />
    </main>
  );
}

/** The language of the editors, which are created anew once Blockly has its messages in another one. */
function useEditorsLanguage(): string {
  const { i18n } = useTranslation();
  const [language, setLanguage] = useState(i18n.language);
  useEffect(() => {
    if (language === i18n.language) return;
    void setBlocklyLanguage(currentLanguage()).then(() => {
      collectEdits();
      setLanguage(i18n.language);
    });
  }, [i18n.language, language]);
  return language;
}

export function App() {
  const { t, i18n } = useTranslation();
  const [ready, setReady] = useState(false);
  const gone = useStudio((studio) => studio.serverGone);
  useEffect(() => {
    if (!ready && !gone) void attempt(prepare).then(() => setReady(useStudio.getState().generation > 0));
  }, [ready, gone]);
  return (
    // Numbers and units follow the page's language, not the browser's.
    <I18nProvider locale={i18n.language}>
      <div className={css.app}>
        <SkipLinks />
        <Header />
        <ServerBanner />
        {ready ? <Work /> : <p className={classes(controls.quiet, areas.loading)}>{t("app.loading")}</p>}
        <Views />
        {ready && <Tour />}
        <Dialogs />
        <Notices />
      </div>
    </I18nProvider>
  );
}
