"""Keys files: who gets in where, by real TLS handshakes in memory."""

import os
import re
import ssl
import stat
import sys
from datetime import UTC, datetime, timedelta

import pytest
from cryptography.hazmat.primitives import serialization

from motorcade.drive.certificates import CarKeys, make_keys
from motorcade.drive.connection import Address, to_error
from motorcade.drive.keys import client_context, https_context, name_in, peer_name, server_context
from motorcade.errors import MotorcadeError

NOW = datetime.now(UTC)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys") / "class 3b 三年级"
    make_keys(folder, [CarKeys("ada", ("192.168.1.20", "ada.school.example"))], ["lin", "小林"], NOW)
    return folder


@pytest.mark.parametrize("has_telemetry", [False, True])
@pytest.mark.parametrize("takes_keys", [False, True])
def test_a_car_that_hangs_up_refused_the_keys_only_where_it_takes_some_and_had_sent_nothing(
    folder, takes_keys, has_telemetry
):
    tls = client_context(folder / "driver-lin.pem") if takes_keys else None
    problem = to_error(Address("127.0.0.1", 5005, 5006, tls), EOFError(), has_telemetry)
    is_of_keys = takes_keys and not has_telemetry
    assert problem.code == ("keys-refused" if is_of_keys else "hung-up")


@pytest.mark.parametrize(
    ("cut", "says"),
    [
        (lambda parts, others: [], "its key and certificate are unreadable"),
        (lambda parts, others: parts[:1], "its key and certificate are unreadable"),
        (lambda parts, others: parts[1:], "its key and certificate are unreadable"),
        (lambda parts, others: [part[:99] for part in parts], "its key and certificate are unreadable"),
        (lambda parts, others: [parts[0], *others[1:]], "KEY_VALUES_MISMATCH"),
    ],
)
def test_what_is_wrong_in_a_keys_file_is_said(folder, tmp_path, cut, says):
    parts, others = (
        re.findall(r"-----BEGIN.*?-----END [^-]*-----\n", (folder / name).read_text(encoding="utf-8"), re.DOTALL)
        for name in ("driver-lin.pem", "car-ada.pem")
    )
    (tmp_path / "cut.pem").write_text("".join(cut(parts, others)), encoding="utf-8")
    with pytest.raises(MotorcadeError) as refused:
        client_context(tmp_path / "cut.pem")
    assert says in refused.value.sentence("en")


@pytest.mark.parametrize("ciphers", ["ECDHE+AESGCM", "ECDHE+AES:!AESGCM", "ECDHE+CHACHA20"])
def test_a_chips_older_tls_has_no_weaker_cipher_than_a_cars(folder, ciphers):
    chip = server_context(folder / "car-ada.pem")
    chip.minimum_version = chip.maximum_version = ssl.TLSVersion.TLSv1_2
    chip.set_ciphers(ciphers)
    driver = client_context(folder / "driver-lin.pem", takes_chips=True)
    if ciphers == "ECDHE+AESGCM":
        shake(driver, chip, "ada")
        return
    with pytest.raises(ssl.SSLError):
        shake(driver, chip, "ada")


def shake(client, server, host):
    """Both ends after their handshake, joined in memory; raises what either end raises."""
    to_client, to_server = ssl.MemoryBIO(), ssl.MemoryBIO()
    ends = (
        client.wrap_bio(to_client, to_server, server_hostname=host),
        server.wrap_bio(to_server, to_client, server_side=True),
    )
    waiting = list(ends)
    while waiting:
        for end in tuple(waiting):
            try:
                end.do_handshake()
            except ssl.SSLWantReadError:
                continue
            waiting.remove(end)
    return ends


@pytest.mark.parametrize(
    "host", ["ada", "ada.local", "192.168.1.20", "ada.school.example", "localhost", "127.0.0.1", "::1"]
)
def test_a_car_and_a_driver_of_one_authority_know_each_other_by_name(folder, host):
    client, server = client_context(folder / "driver-小林.pem"), server_context(folder / "car-ada.pem")
    driver_end, car_end = shake(client, server, host)
    assert driver_end.version() == car_end.version() == "TLSv1.3"
    assert (peer_name(driver_end), peer_name(car_end)) == ("ada", "小林")


def test_a_car_whose_name_is_chinese_is_known_by_it(tmp_path):
    make_keys(tmp_path, [CarKeys("小车")], ["lin"], NOW)
    client, server = client_context(tmp_path / "driver-lin.pem"), server_context(tmp_path / "car-小车.pem")
    for host in ("小车", "小车.local"):
        driver_end, _ = shake(client, server, host)
        assert peer_name(driver_end) == "小车"
    with pytest.raises(ssl.SSLCertVerificationError, match="match"):
        shake(client, server, "大车")


def test_a_car_is_called_as_its_keys_say(folder):
    assert name_in(folder / "car-ada.pem") == "ada"
    assert name_in(None) == ""


def test_a_driver_can_not_pose_as_a_car(folder):
    posing = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    posing.load_cert_chain(folder / "driver-lin.pem")
    with pytest.raises(ssl.SSLCertVerificationError, match="purpose"):
        shake(client_context(folder / "driver-lin.pem"), posing, "ada")


def test_keys_that_are_over_or_not_yet_valid_are_refused_and_a_slow_clock_is_not(folder, tmp_path):
    for number, (made, fine) in enumerate([(-401, False), (-399, True), (364, True), (366, False)]):
        there = tmp_path / str(number)
        make_keys(there, [CarKeys("ada")], ["lin"], NOW + timedelta(days=made))
        client, server = client_context(there / "driver-lin.pem"), server_context(there / "car-ada.pem")
        if fine:
            shake(client, server, "ada")
        else:
            with pytest.raises(ssl.SSLCertVerificationError, match=r"expired|not yet valid"):
                shake(client, server, "ada")


def test_a_browser_that_trusts_the_authority_gets_the_page_and_shows_nothing(folder):
    browser = ssl.create_default_context(cafile=folder / "authority.crt")
    # What Python 3.13 demands of certificates, and browsers too.
    browser.verify_flags |= ssl.VERIFY_X509_STRICT
    _, car_end = shake(browser, https_context(folder / "car-ada.pem"), "192.168.1.20")
    assert peer_name(car_end) is None


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no file modes")
def test_only_the_owner_may_read_what_is_secret(tmp_path):
    before = os.umask(0)
    try:
        made = make_keys(tmp_path, [CarKeys("ada")], ["lin"], NOW)
    finally:
        os.umask(before)
    modes = {file.name: stat.S_IMODE(file.stat().st_mode) for file in made}
    assert modes.pop("authority.crt") & 0o444 == 0o444
    assert modes == {"authority.pem": 0o600, "car-ada.pem": 0o600, "driver-lin.pem": 0o600}


@pytest.mark.parametrize(
    ("cars", "drivers", "says"),
    [
        ([CarKeys("../ada")], [], "no name for a car"),
        ([CarKeys("三年级的红色小车和蓝色小车" * 3)], [], "no name for a car"),
        ([CarKeys("eve", ("no address",))], [], "no address of a car"),
        ([], ["lin/../.."], "no name for a driver"),
        ([], ["x" * 41], "up to 40"),
        ([], ["lin", "lin"], "named twice"),
        ([CarKeys("eve")], ["lin"], "exists already"),
    ],
)
def test_what_can_not_be_made_is_refused_and_nothing_is_made(folder, cars, drivers, says):
    before = sorted(folder.iterdir())
    with pytest.raises(match=says):
        make_keys(folder, cars, drivers, NOW)
    assert sorted(folder.iterdir()) == before


def without_authority(text):
    return text[: text.rindex("-----BEGIN CERTIFICATE-----")]


def with_broken_authority(text):
    # OpenSSL doesn't see a certificate that begins within a line, so the keys in front of it are fine.
    return without_authority(text) + "authority: -----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits no file's size")
@pytest.mark.parametrize("most_bytes", [100, 800])
def test_a_full_disk_leaves_no_half_written_keys(tmp_path, most_bytes):
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert list(tmp_path.iterdir()) == []
    assert make_keys(tmp_path, [CarKeys("ada")], ["lin"], datetime.now(UTC))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: "", "is no keys file"),
        (lambda text: "\udcff", "isn't text"),
        (lambda text: text.replace("PRIVATE KEY", "SECRET"), "is no keys file"),
        (without_authority, "no certificate of an authority"),
        (with_broken_authority, "its last certificate can't be read"),
        (lambda text: text.replace("driver lin", "car lin"), "the keys of a driver are needed"),
    ],
    ids=["empty", "not text", "no key", "no authority", "broken authority", "a car's"],
)
def test_a_file_that_is_no_keys_file_is_refused_in_a_sentence(folder, tmp_path, change, says):
    broken = tmp_path / "broken.pem"
    broken.write_text(
        change((folder / "driver-lin.pem").read_text(encoding="ascii")), encoding="utf-8", errors="surrogateescape"
    )
    with pytest.raises(match=says):
        client_context(broken)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(match="can't be read: there is no such file"):
        client_context(tmp_path / "there-is-none.pem")


def test_a_key_with_a_password_is_refused_without_asking_for_it(folder, tmp_path):
    text = (folder / "driver-lin.pem").read_bytes()
    key = serialization.load_pem_private_key(text, password=None)
    encoding, kind = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8
    locked = tmp_path / "locked.pem"
    locked.write_bytes(
        key.private_bytes(encoding, kind, serialization.BestAvailableEncryption(b"secret"))
        + text[text.index(b"-----BEGIN CERTIFICATE-----") :]
    )
    with pytest.raises(match="password"):
        client_context(locked)


def test_a_folder_whose_authority_is_broken_says_so(tmp_path):
    (tmp_path / "authority.pem").write_text("nothing")
    with pytest.raises(match=r"authority.pem can't be read"):
        make_keys(tmp_path, [], ["lin"], NOW)
