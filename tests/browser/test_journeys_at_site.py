"""Ten journeys through the studio's page as a site, where Python answers in a worker; `make soak` takes all of them.

They are tests of other files, here one after another: Python's memory is stored once, and later pages begin with it.
"""

from support.soak import SOAK

if not SOAK:
    from tests.browser.test_building import (
        example_words,
        test_a_block_highlights_its_bits_and_bits_select_their_block,
        test_a_block_that_is_not_attached_looks_so_and_a_sentence_says_so,
        test_blocks_are_copied_between_the_editors_but_for_a_leaders_infrared,
        test_more_states_than_a_car_holds_are_refused,
        test_the_documents_example_is_built_with_the_mouse,
    )
    from tests.browser.test_missions import test_back_leads_from_a_mission_to_the_map_and_not_out_of_the_page
    from tests.browser.test_projects import test_blocks_and_words_are_exported
    from tests.browser.test_python import (
        test_a_wrong_block_says_what_would_fix_it_and_keeps_the_cars_from_driving,
        test_the_text_and_the_blocks_follow_each_other,
    )
    from tests.browser.test_upload import test_a_program_is_uploaded_to_the_virtual_car_and_read_back_as_blocks

    __all__ = [
        "example_words",
        "test_a_block_highlights_its_bits_and_bits_select_their_block",
        "test_a_block_that_is_not_attached_looks_so_and_a_sentence_says_so",
        "test_a_program_is_uploaded_to_the_virtual_car_and_read_back_as_blocks",
        "test_a_wrong_block_says_what_would_fix_it_and_keeps_the_cars_from_driving",
        "test_back_leads_from_a_mission_to_the_map_and_not_out_of_the_page",
        "test_blocks_and_words_are_exported",
        "test_blocks_are_copied_between_the_editors_but_for_a_leaders_infrared",
        "test_more_states_than_a_car_holds_are_refused",
        "test_the_documents_example_is_built_with_the_mouse",
        "test_the_text_and_the_blocks_follow_each_other",
    ]
