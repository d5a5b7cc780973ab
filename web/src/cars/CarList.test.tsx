import { renderToString } from "react-dom/server";
import { expect, it } from "vitest";
import { CarList } from "./CarList";

it("speaks the page's language from its first picture on", () => {
  const shown = (language: string) => renderToString(<CarList path="/api/cars" language={language} image={null} program="" />);
  expect(shown("zh")).toContain("全部停下");
  expect(shown("en")).not.toContain("全部停下");
});
