import { useEffect, useState, type CSSProperties, type MouseEvent } from "react";
import { I18nProvider, ToggleButton, ToggleButtonGroup } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { setBlocklyLanguage } from "../blocks/messages";
import { Editors } from "../blocks/Editors";
import { hatOf } from "../blocks/toolbox";
import { showBlock, workspaceOf } from "../blocks/workspaces";
import { attempt } from "../projects/actions";
import { currentLanguage } from "../i18n";
import { flush } from "../words/compiling";
import { WordsPanel } from "../words/WordsPanel";
import { Dialogs } from "./Dialogs";
import { Divider } from "./Divider";
import { Header } from "./Header";
import { Icon, type IconName } from "./icons";
import { Mat } from "./Mat";
import { Notices, ServerBanner } from "./Notices";
import { useSettings } from "./settings";
import { useDialog } from "./shortcuts";
import { begin, prepare } from "./start";
import { useStudio, type View } from "./store";
import { Tour } from "./Tour";

const VIEW_ICONS: Record<View, IconName> = { leader: "blocks", followers: "blocks", words: "words", mat: "mat" };

/** On a narrow screen one area shows at a time. */
function Views() {
  const { t } = useTranslation();
  const view = useStudio((studio) => studio.view);
  const followed = useStudio((studio) => studio.followers !== null);
  const views: View[] = followed ? ["leader", "followers", "words", "mat"] : ["leader", "words", "mat"];
  return (
    <nav className="views" aria-label={t("app.views")}>
      <ToggleButtonGroup
        aria-label={t("app.views")}
        disallowEmptySelection
        selectedKeys={[view]}
        onSelectionChange={(keys) => useStudio.setState({ view: [...keys][0] as View })}
      >
        {views.map((name) => (
          <ToggleButton key={name} id={name} className="view">
            <Icon name={VIEW_ICONS[name]} />
            {t(`views.${name}`)}
          </ToggleButton>
        ))}
      </ToggleButtonGroup>
    </nav>
  );
}

/** To the hat, where what is fetched next from the toolbox is hung below. A fragment alone wouldn't move Blockly's focus. */
function focusBlocks(event: MouseEvent): void {
  event.preventDefault();
  showBlock("leader", workspaceOf("leader")?.getBlocksByType(hatOf("leader"))[0]?.id ?? "");
}

function SkipLinks() {
  const { t } = useTranslation();
  return (
    <nav className="skip-links" aria-label={t("app.skip")}>
      <a href="#leader-blocks" onClick={focusBlocks}>
        {t("app.skipBlocks")}
      </a>
      <a href="#words">{t("app.skipWords")}</a>
      <a href="#mat">{t("app.skipMat")}</a>
    </nav>
  );
}

function Work() {
  const { t } = useTranslation();
  const language = useEditorsLanguage();
  const view = useStudio((studio) => studio.view);
  const shares = useSettings((settings) => settings.shares);
  const share = (changed: Partial<typeof shares>) => useSettings.setState({ shares: { ...shares, ...changed } });
  useEffect(begin, []);
  return (
    <main className="work" data-view={view} style={{ "--share": shares.page } as CSSProperties}>
      <div className="left" style={{ "--share": shares.words } as CSSProperties}>
        <Editors key={language} />
        <Divider label={t("words.divider")} orientation="horizontal" reversed share={shares.words} onShare={(words) => share({ words })} />
        <section className="words-panel panel" data-view="words" id="words" tabIndex={-1} aria-labelledby="words-title">
          <WordsPanel />
        </section>
      </div>
      <Divider label={t("app.divider")} orientation="vertical" share={shares.page} onShare={(page) => share({ page })} />
      <Mat />
    </main>
  );
}

/** The language of the editors: Blockly has to have its words before they are made anew. */
function useEditorsLanguage(): string {
  const { i18n } = useTranslation();
  const [language, setLanguage] = useState(i18n.language);
  useEffect(() => {
    if (language === i18n.language) return;
    void setBlocklyLanguage(currentLanguage()).then(() => {
      flush();
      setLanguage(i18n.language);
    });
  }, [i18n.language, language]);
  return language;
}

export function App() {
  const { t, i18n } = useTranslation();
  const [ready, setReady] = useState(false);
  const gone = useStudio((studio) => studio.serverGone);
  const dialog = useDialog((state) => state.open);
  useEffect(() => {
    if (!ready && !gone) void attempt(prepare).then(() => setReady(useStudio.getState().generation > 0));
  }, [ready, gone]);
  return (
    // Numbers and units follow the page's language, not the browser's.
    <I18nProvider locale={i18n.language}>
      <div className="app">
        <SkipLinks />
        <Header onDialog={(open) => useDialog.setState({ open })} />
        <ServerBanner />
        {ready ? <Work /> : <p className="quiet loading">{t("app.loading")}</p>}
        <Views />
        {ready && <Tour />}
        <Dialogs open={dialog} onClose={() => useDialog.setState({ open: null })} />
        <Notices />
      </div>
    </I18nProvider>
  );
}
