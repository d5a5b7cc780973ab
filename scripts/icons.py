"""Make the icons of the installed studio, web/public/icons, from web/public/icon.svg."""

from pathlib import Path

from playwright.sync_api import sync_playwright
from scripts import chromium

PUBLIC = Path(__file__).resolve().parents[1] / "web" / "public"
# Name, pixels, and the share of the width that the picture fills. A system cuts any shape out of a maskable icon, at
# least a circle of 80% of its width.
ICONS = (("icon-192", 192, 1.0), ("icon-512", 512, 1.0), ("maskable-512", 512, 0.8), ("apple-touch-180", 180, 0.9))


def main() -> None:
    """Draw all icons with Chromium."""
    picture = (PUBLIC / "icon.svg").read_text(encoding="utf-8")
    (PUBLIC / "icons").mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium.find_or_install())
        for name, pixels, share in ICONS:
            page = browser.new_page(viewport={"width": pixels, "height": pixels})
            # The picture's own colour fills what it leaves free.
            ground = picture.partition('fill="')[2][:7] if share < 1 else "transparent"
            style = f"margin:0;background:{ground};display:grid;place-items:center;height:100vh"
            page.set_content(f'<body style="{style}">{picture}<style>svg{{width:{share * 100}vw}}</style>')
            page.screenshot(path=PUBLIC / "icons" / f"{name}.png", omit_background=True)
        browser.close()


if __name__ == "__main__":
    main()
