"""Each failure of a line, and each further try, has its sentences in both languages."""

import re

import pytest

from motorcade.upload import transfer as talk
from motorcade.upload.failures import HOLDS, MESSAGES, RETRIES, PortError, retry_sentence

FILLED = {"port": "PORT", "detail": "DETAIL", "group": "GROUP", "list": "LIST"}


@pytest.mark.parametrize("code", MESSAGES)
@pytest.mark.parametrize("holds", ["", *HOLDS])
def test_every_failure_has_its_sentences_in_both_languages(code, holds):
    problem = PortError(code, **FILLED, holds=holds)
    assert ("PORT" in str(problem)) == ("PORT" in problem.message("zh"))
    assert problem.message("zh").endswith(("。", "？"))
    assert problem.message("en") == str(problem)
    assert not holds or (HOLDS[holds]["en"] in str(problem) and HOLDS[holds]["zh"] in problem.message("zh"))


@pytest.mark.parametrize("reason", RETRIES)
@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_further_try_has_a_sentence_in_both_languages(reason, language):
    assert re.search("2.*3", retry_sentence(talk.Retry(reason, 2, 3), language))
