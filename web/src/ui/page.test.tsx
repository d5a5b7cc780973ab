import { cleanup, render, screen, waitFor } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { useState } from "react";
import { afterEach, beforeAll, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/class";
import { changeLanguage, startTexts, useTexts } from "../i18n";
import { ask, confirm } from "../state/questions";
import { useSettings } from "../state/settings";
import { Action, Choice, Field, Form, Page, Problem, Tick } from "./page";

beforeAll(async () => {
  await startTexts(texts);
  // A page fetches it when it first asks something.
  await import("./QuestionDialog");
});
afterEach(async () => {
  cleanup();
  await changeLanguage("en");
});

function Sample({ onSubmit = () => undefined }: { onSubmit?: (text: string) => void }) {
  const t = useTexts("class");
  const [text, setText] = useState("");
  const [ticked, setTicked] = useState(false);
  const [chosen, setChosen] = useState("b");
  return (
    <Page title={t("joinTitle")}>
      <Form onSubmit={() => onSubmit(text)}>
        <Field label="Name" hint="As you like" value={text} onChange={setText} most={5} />
        <Tick checked={ticked} onChange={setTicked}>
          Agreed
        </Tick>
        <Choice label="Letter" value={chosen} onChange={setChosen}>
          <option>a</option>
          <option>b</option>
        </Choice>
        <Problem text={ticked ? "too fast" : ""} />
        <Action type="submit">Send</Action>
      </Form>
    </Page>
  );
}

describe("a small page", () => {
  it("has named fields: a hint is read out, no more is typed than fits, Enter sends", async () => {
    const [user, sent] = [userEvent.setup({ delay: null }), vi.fn()];
    render(<Sample onSubmit={sent} />);
    const field = screen.getByRole("textbox", { name: "Name" });
    expect(field.getAttribute("aria-describedby")).toBe(screen.getByText("As you like").id);
    await user.type(field, "abcdefg{Enter}");
    expect(sent.mock.calls).toEqual([["abcde"]]);
    await user.selectOptions(screen.getByRole("combobox", { name: "Letter" }), "a");
    await user.click(screen.getByRole("checkbox", { name: "Agreed" }));
    expect(screen.getByRole("alert").textContent).toBe("too fast");
    expect(sent).toHaveBeenCalledTimes(1);
  });

  it("closes its settings by Escape, which leads back to their button, and by a press elsewhere alone", async () => {
    const user = userEvent.setup({ delay: null });
    render(<Sample />);
    const language = screen.getByRole<HTMLSelectElement>("combobox", { name: "Language" });
    const sheet = language.closest("details")!;
    sheet.open = true;
    await user.click(language);
    expect(sheet.open).toBe(true);
    await user.keyboard("{Escape}");
    expect([sheet.open, document.activeElement]).toEqual([false, sheet.querySelector("summary")]);
    sheet.open = true;
    await user.click(screen.getByRole("textbox", { name: "Name" }));
    expect(sheet.open).toBe(false);
  });

  it("changes its language and colours at once, its title too, and keeps the language", async () => {
    const user = userEvent.setup({ delay: null });
    render(<Sample />);
    expect(document.title).toBe("Join the class · Motorcade");
    await user.selectOptions(screen.getByRole("combobox", { name: "Language" }), "zh");
    await waitFor(() => expect(screen.getByRole("heading").textContent).toBe("加入课堂"));
    expect([document.documentElement.lang, document.title, localStorage.getItem("motorcade.language")]).toEqual(["zh", "加入课堂 · Motorcade", "zh"]);
    await user.selectOptions(screen.getByRole("combobox", { name: "外观" }), "dark");
    expect(useSettings.getState().theme).toBe("dark");
  });
});

describe("a question", () => {
  const question = { title: "Delete it?", text: "It is gone then.", yes: "Delete" };

  it("is answered by its buttons; Escape and a second question say no", async () => {
    const user = userEvent.setup({ delay: null });
    render(<Sample />);
    const agreed = confirm(question);
    await user.click(await screen.findByRole("button", { name: "Delete" }));
    expect(await agreed).toBe(true);
    const refused = confirm(question);
    expect(await screen.findByRole("alertdialog", { name: "Delete it?" })).toBeTruthy();
    await user.keyboard("{Escape}");
    expect(await refused).toBe(false);
    const first = confirm(question);
    const second = ask({ ...question, other: "Copy" });
    expect(await first).toBe(false);
    await user.click(await screen.findByRole("button", { name: "Copy" }));
    expect(await second).toBe("other");
    await waitFor(() => expect(screen.queryByRole("alertdialog")).toBeNull());
  });
});
