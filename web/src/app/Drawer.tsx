import { lazy, type CSSProperties, type ReactNode, useRef } from "react";
import { Tab, TabList, TabPanel, Tabs } from "react-aria-components";
import { useStops } from "../certainty/stops";
import { useTexts } from "../i18n";
import { openDialog } from "../state/dialogs";
import { type DrawerTab, type Level, LEVELS, openDrawer, useSettings } from "../state/settings";
import { Divider, Later, usePrinting } from "../ui/panes";
import { classes } from "../ui/classes";
import { IconButton, TextButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import { PythonPanel } from "../python/PythonPanel";
import { WordsPanel } from "../words/WordsPanel";
import areas from "../ui/areas.module.css";
import css from "./drawer.module.css";

interface Panel {
  id: DrawerTab;
  /** The level from which on it is there. */
  from: Level;
  content: ReactNode;
}

const CarsPanel = lazy(async () => ({ default: (await import("../mat/CarsPanel")).CarsPanel }));
const Inspector = lazy(async () => ({ default: (await import("../mat/Inspector")).Inspector }));
const Timeline = lazy(async () => ({ default: (await import("../timeline/Timeline")).Timeline }));

const CertaintyPanel = lazy(async () => ({ default: (await import("../certainty/Panel")).CertaintyPanel }));

/** What is looked up below blocks and stage, in the order of its tabs. */
const PANELS: readonly Panel[] = [
  { id: "swarm", from: "start", content: <CarsPanel /> },
  { id: "things", from: "start", content: <Inspector /> },
  { id: "sure", from: "start", content: <CertaintyPanel /> },
  { id: "timeline", from: "words", content: <Timeline /> },
  { id: "words", from: "words", content: <WordsPanel /> },
  { id: "python", from: "python", content: <PythonPanel /> },
];

/** One drawer for what is looked up; it opens at the tab, and as high, as it was left. */
export function Drawer() {
  const t = useTexts();
  const { level, drawer, shares } = useSettings();
  const printing = usePrinting();
  // Whoever stops the world looks at what was before.
  const stops = useStops((now) => now.stops.length > 0);
  const panels = PANELS.filter(({ id, from }) => LEVELS.indexOf(from) <= LEVELS.indexOf(level) || (stops && id === "timeline"));
  const shown = printing ? "words" : (panels.find(({ id }) => id === drawer.tab) ?? panels[0]!).id;
  const open = drawer.open || printing;
  // A tab is selected when it is pressed, before it knows whether to close the drawer.
  const openBefore = useRef<DrawerTab | null>(null);
  const noteBefore = () => (openBefore.current = open ? shown : null);
  const setOpen = (to: boolean) => useSettings.setState({ drawer: { tab: shown, open: to } });
  return (
    <section
      id="drawer"
      className={classes("printed-whole", css.drawer, areas.panel)}
      data-open={open || undefined}
      tabIndex={-1}
      aria-label={t("drawer.title")}
      style={{ "--share": shares.drawer } as CSSProperties}
    >
      {open && (
        <Divider
          label={t("drawer.divider")}
          orientation="horizontal"
          reversed
          share={shares.drawer}
          onShare={(share) => useSettings.setState({ shares: { ...shares, drawer: share } })}
        />
      )}
      <Tabs
        className="column flush fill printed-whole"
        selectedKey={shown}
        onSelectionChange={(key) => useSettings.setState({ drawer: { tab: key as DrawerTab, open: drawer.open } })}
      >
        <div className={classes("unprinted", css.bar)} onPointerDownCapture={noteBefore} onKeyDownCapture={noteBefore}>
          {/* What scrolls is not the list itself: React Aria would scroll that back, away from under a finger, when it gets the focus. */}
          <div className={css.scroller}>
            <TabList className={css.tablist} aria-label={t("drawer.title")}>
              {panels.map(({ id }) => (
                <Tab key={id} id={id} className={css.tab} onPress={() => (openBefore.current === id ? setOpen(false) : openDrawer(id))}>
                  {t(`drawer.${id}`)}
                </Tab>
              ))}
            </TabList>
          </div>
          <UploadAgain />
          <IconButton
            icon={open ? "down" : "up"}
            label={t(open ? "drawer.close" : "drawer.open")}
            aria-expanded={open}
            onPress={() => setOpen(!open)}
          />
        </div>
        {panels.map(({ id, content }) => (
          // A closed drawer keeps its panel, since the tab says that it controls it.
          <TabPanel key={id} id={id} className={css.panel} style={open ? undefined : { display: "none" }}>
            {open && <Later>{content}</Later>}
          </TabPanel>
        ))}
      </Tabs>
    </section>
  );
}

/** For whoever has a car: a program has reached it from here before. */
function UploadAgain() {
  const t = useTexts();
  const uploaded = useSettings((settings) => settings.uploaded);
  if (!uploaded) return null;
  return (
    <TextButton quiet onPress={() => openDialog("upload")}>
      <Icon name="upload" />
      {t("upload.open")}
    </TextButton>
  );
}
