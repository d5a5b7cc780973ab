"""What becomes of an upload is told as it is, and a car gives back its program."""

from playwright.sync_api import expect

from studio_programs import FOLLOWED

WORDS = ["02010200", "65800000", "6a800000", "b5000000"]


def test_the_virtual_car_takes_a_program_and_gives_it_back_as_blocks(open_page) -> None:
    studio = open_page(project=FOLLOWED)
    studio.page.get_by_role("button", name="Upload", exact=True).click()
    dialog = studio.dialog("upload.title")
    dialog.get_by_text("Virtual car", exact=True).click()
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog.get_by_role("status")).to_contain_text("Verified: the car holds this program.")

    again = open_page()
    again.page.get_by_role("button", name="Upload", exact=True).click()
    dialog = again.dialog("upload.title")
    dialog.get_by_text("Virtual car", exact=True).click()
    dialog.get_by_role("button", name="Read back").click()
    dialog.get_by_role("button", name="Open as blocks").click()
    again.expect_words(WORDS)
    expect(again.block("followers", "right")).to_be_visible()


def test_an_upload_that_nobody_checked_is_not_called_verified(open_page) -> None:
    studio = open_page(project=FOLLOWED)
    studio.page.get_by_role("button", name="Upload", exact=True).click()
    dialog = studio.dialog("upload.title")
    dialog.get_by_text("Virtual car", exact=True).click()
    dialog.get_by_text("Check that the car got it all").click()
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog.get_by_role("status")).to_contain_text("Sent, not verified.")


def test_a_server_that_dies_in_an_upload_is_told(open_own_page, own_studio) -> None:
    studio = open_own_page(project=FOLLOWED)
    studio.forgive("ERR_CONNECTION_REFUSED", "WebSocket connection")
    studio.page.get_by_role("button", name="Upload", exact=True).click()
    dialog = studio.dialog("upload.title")
    dialog.get_by_text("Virtual car", exact=True).click()
    own_studio.kill()
    dialog.get_by_role("button", name="Upload").click()
    expect(dialog.get_by_role("alert")).to_contain_text("What the car holds now is not known")
