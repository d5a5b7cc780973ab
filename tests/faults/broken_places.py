"""Ways to break the code: as it once was, or could be. `tests.faults.breaks` tries them."""

from typing import Any, NamedTuple


class Break(NamedTuple):
    """One place of the code, what is there, what is there instead, and the scenario that has to notice it.

    A hole that only many seeds find is looked for from the ``first`` on, which found it.
    """

    name: str
    kind: str
    file: str
    before: str
    after: str
    first: int = 0


# By scenario and file: the name of each break, what is there, what is there instead, and its first seed.
_PLACES: dict[tuple[str, str], tuple[tuple[Any, ...], ...]] = {
    ("uploads", "config/files.py"): (
        ("no-fsync", "os.fsync(file.fileno())", "pass"),
        ("no-fsync-of-the-folder", "    _keep_names(path.parent)\n", "    pass\n"),
        ("folder-errors-ignored", "if problem.errno in _FAILURES:", "if problem.errno in ():"),
        ("written-in-place", "temporary.replace(path)", "path.write_bytes(data)"),
        ("rubbish-stays", "temporary.unlink(missing_ok=True)", "pass"),
    ),
    ("uploads", "words/receiver.py"): (
        ("uploads-spliced", "    if count > 0 and is_empty_image == 0:", "    if 0:"),
        ("any-checksum-taken", "if r[IS_ANNOUNCED] and r[CRC] != r[ANNOUNCED]:", "if 0:"),
    ),
    ("uploads", "car/loop.py"): (
        (
            "answers-before-it-stores",
            "            self._answers += error_line(CANT_STORE)\n            return\n",
            "            pass\n",
        ),
    ),
    ("uploads", "upload/transfer.py"): (
        (
            "holds-old-said-too-early",
            "outcome = yield from self._send_image(EITHER)",
            "outcome = yield from self._send_image(OLD)",
        ),
        ("no-settling", "SETTLE_MS = upload.SILENCE_MS + 100", "SETTLE_MS = 0"),
        (
            "a-bad-line-for-an-old-car",
            "    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason",
            "    if False and reason",
        ),
    ),
    ("uploads", "boards/lines.py"): (
        ("a-lost-port-stays-lost", "            self._last_try_s = now_s\n", "            return None\n"),
    ),
    ("uploads", "boards/on_chip/wifi_line.py"): (
        (
            "a-mute-client-keeps-the-port",
            "if not data and (uploader.is_gone or elapsed_ms(self._now_ms(), uploader.last_byte_ms) >= _IDLE_MS):",
            "if not data and uploader.is_gone:",
        ),
    ),
    ("driving", "car/arbiter.py"): (
        (
            "failsafe-too-late",
            "        if silent_ms <= self._failsafe_ms:\n            return self._failsafe_ms + 1 - silent_ms\n",
            "        if silent_ms <= 600:\n            return 601 - silent_ms\n",
        ),
        ("stop-only-of-the-driver", "    (MOVING, STOP, STOPPED),\n", ""),
        ("failsafe-needs-no-arming", "(MOVING, SILENT, FAILSAFE)", "(MOVING, SILENT, READY)"),
        ("a-lost-driver-needs-no-arming", "(MOVING, GONE, FAILSAFE)", "(MOVING, GONE, READY)"),
        ("two-drivers", "return self.driver in (session, NOBODY)", "return True"),
    ),
    ("driving", "drive/server.py"): (("no-watchdog", "rest_ms = self._control.watch()", "rest_ms = 50"),),
    ("driving", "drive/motor_guard.py"): (
        ("guard-ignores-frozen", "if not has_report and self._last >= _MOVING:", "if False:"),
        ("guard-ignores-killed", 'return "killed"', 'return "dismissed"'),
        (
            "guard-begins-a-period-of-its-own",
            "            if last <= _MOVING:\n",
            "            if True:\n",
        ),
        ("frozen-guard-unnoticed", "elif now_s - asked_s > self._answer_s:", "elif False:"),
    ),
    ("driving", "drive/session.py"): (
        (
            "stop-needs-a-place",
            "        self._control.change(None, lambda arbiter, now: arbiter.stop())",
            "        self.take_place()\n        self._control.change(self, lambda arbiter, now: arbiter.stop())",
        ),
    ),
    ("driving", "drive/stamps.py"): (
        ("stamps-ignored", "        return later_ms <= self._stale_ms\n", "        return True\n"),
        (
            "a-stamp-comes-round",
            "return self._fresh_ms is None or self._now_ms - self._fresh_ms > _SILENCE_MS",
            "return self._fresh_ms is None",
        ),
        (
            "first-command-believed",
            "return self._fresh_ms is None or self._now_ms - self._fresh_ms > _SILENCE_MS",
            "return self._fresh_ms is not None and self._now_ms - self._fresh_ms > _SILENCE_MS",
        ),
    ),
    ("driving", "drive/channels.py"): (
        ("who-is-gone-drives-on", "        self.line = None\n        self.own.leave()\n", "        self.line = None\n"),
        ("no-bound-of-answers", "if self.line.get_write_buffer_size() > _MOST_WAITING_BYTES:", "if False:"),
    ),
    ("driving", "drive/deadman.py"): (
        ("a-held-stick-drives-again", "(DRIVING, LOST, LOCKED)", "(DRIVING, LOST, ARMING)"),
    ),
    ("driving", "drive/motors.py"): (
        ("a-fault-is-forgotten", "            arbiter.stall()\n            self._obey", "            self._obey"),
        ("the-horn-goes-on", "        self._fresh_ms = fresh_ms\n", "        self._fresh_ms = 20 * fresh_ms\n"),
        ("unguarded-after-a-fault", "        if not self._may_move:\n", "        if self.is_neutral:\n", 961),
    ),
    ("driving", "drive/listener.py"): (
        (
            "no-bound-of-connections",
            "        places = self._places\n        network = network_of(address)\n",
            "        return True\n",
        ),
    ),
    ("driving", "drive/client.py"): (
        (
            "a-horn-before-the-clock",
            "NEUTRAL))\n                return\n            self._connection.send(self._stamped(stick_word(*axes)))\n",
            "NEUTRAL))\n            else:\n                self._connection.send(self._stamped(stick_word(*axes)))\n",
            2514,
        ),
    ),
    ("fleet", "fleet/contact.py"): (
        ("old-after-a-broken-try", "if transfer.holds != OLD or holds == AWAY:", "if True:"),
        ("unasked-and-away", "if self._loads or not is_asked:", "if self._loads:"),
        (
            "a-stop-waits-for-the-heartbeat",
            "        if self._link:\n            self._send(self._link, kind)",
            "        pass",
        ),
        ("who-was-away-is-not-stopped", "self._send(link, self.wanted or ASK)", "self._send(link, ASK)"),
        (
            "the-dead-are-waited-for",
            "async with asyncio.timeout(_BACK_S):",
            "async with asyncio.timeout(60 * _BACK_S):",
        ),
    ),
    ("fleet", "fleet/cars.py"): (
        (
            "far-hosts",
            "    return address.is_private or address.is_link_local or address.is_loopback",
            "    return True",
        ),
        (
            "found-cars-get-no-order",
            "                if self._ordered:\n                    way.order(self._ordered)\n",
            "",
        ),
        ("one-waits-for-another", "free = asyncio.Semaphore(_AT_ONCE)", "free = asyncio.Semaphore(1)"),
        (
            "one-turn-for-each",
            "            found.again = asyncio.get_running_loop().call_later(found.pause_s, self._wait, found)\n",
            "",
        ),
    ),
    ("fleet", "car/loop.py"): (
        (
            "a-new-program-ends-a-stop",
            "        if not self._is_stopped:\n            step.begin_program(self, now)",
            "        self._is_stopped = False\n        step.begin_program(self, now)",
        ),
    ),
    ("fleet", "boards/lines.py"): (
        (
            "a-stop-waits-for-the-upload",
            "        had_some = False\n",
            "        had_some = False\n        if self._uploader is not None:\n            return False\n",
        ),
    ),
    ("class", "classroom/running.py"): (
        ("one-library-for-all", "lambda: self._ports(visitor), visitor)", 'lambda: self._ports(visitor), "01")'),
        ("refused-and-done", "            self.room.restore()\n", "            pass\n"),
        ("undone-and-answered", "        if since <= self._undone:\n", "        if False:\n"),
        ("two-store-at-once", "            async with self._storing:\n", "            if True:\n"),
    ),
    ("class", "classroom/app.py"): (
        ("answers-before-it-is-stored", "        await running.settle(since)\n", "        running.show_changes()\n"),
        ("pupils-ask-as-teacher", "        if holder != TEACHER:\n", "        if False:\n"),
    ),
    ("class", "server/studio/library.py"): (
        ("versions-in-place", "replace_file(_file(folder, version), data)", "_file(folder, version).write_bytes(data)"),
    ),
    ("class", "classroom/room.py"): (
        (
            "devices-forgotten",
            "_MOST_DEVICES + 1 :], device]\n        self.save()\n",
            "_MOST_DEVICES + 1 :], device]\n",
        ),
        (
            "nobody-sees-the-stop",
            "        self.stopped = stopped\n        self.changes += 1\n",
            "        self.stopped = stopped\n",
        ),
        (
            "nobody-sees-the-freeze",
            "        self.frozen = frozen\n        self.changes += 1\n",
            "        self.frozen = frozen\n",
        ),
        ("the-other-pupil-comes-back", "if likeness(pupil.name) == alike), None)", "if alike), None)"),
    ),
    ("class", "classroom/folder.py"): (
        ("drafts-in-place", "replace_file(folder / DRAFT, data)", "(folder / DRAFT).write_bytes(data)"),
    ),
    ("lesson", "classroom/room.py"): (
        (
            "wrong-number-lets-in",
            "pupil is None or not compare_digest(typed_number(typed).encode(), pupil.number.encode())",
            "pupil is None",
        ),
        ("numbers-guessed-without-end", "            self.of_a_name.add(alike, now_s)\n", ""),
        ("who-has-gone-comes-back", "            change(self.kept)", "            pass"),
        ("stopped-cars-drive", "return not self.stopped and not self.frozen and", "return not self.frozen and"),
        ("teacher-for-ever", "device != device]", "device == device]"),
        ("nine-devices", "pupil.devices[-_MOST_DEVICES + 1 :]", "pupil.devices"),
        (
            "a-full-disk-signs-nobody-out",
            "            self.part(sign_out)\n",
            "            sign_out(self.record)\n            self.save()\n",
        ),
        ("a-number-is-given-again", "        stored.joined = self.record.joined\n", ""),
    ),
    ("lesson", "classroom/record.py"): (
        ("one-wrong-letter-deletes-all", "ClassRecord(Struct, forbid_unknown_fields=True)", "ClassRecord(Struct)"),
        ("a-former-mission-counts", "            self.most_met = 0\n", ""),
        ("one-wrong-digit-deletes-all-of-one", "all(is_known(record, owner) for owner in owners)", "owners"),
    ),
    ("lesson", "classroom/pairs.py"): (
        (
            "window-of-another-written",
            "        if owner != who:\n            raise",
            "        if False:\n            raise",
        ),
    ),
    ("lesson", "classroom/running.py"): (
        ("frozen-worlds-play", "if self.room.frozen and isinstance(message, Play | StepWorld)", "if False"),
        ("no-rate", "            self.rates.count(visitor, self.settings.clock())", "            pass"),
        ("any-page-any-world", "        return visitor == owner\n", "        return True\n"),
        ("cable-of-another", "                self.room.check_cable(visitor)", "                pass"),
        ("an-old-release-lifts-a-stop", "while self._cars.stops[car] == stops:", "while True:", 84),
        ("cookies-without-https", 'secure = connection.scope["scheme"] in ("https", "wss")', "secure = False"),
        ("all-wait-for-one", "setdefault((visitor, request == CHECK)", 'setdefault(("", request == CHECK)'),
    ),
    ("lesson", "server/request_filter.py"): (
        ("a-stream-that-is-over-is-logged", "if is_over and connection and not is_socket:", "if False:"),
        ("sockets-are-counted-for-ever", "                alike.remove(socket)\n", "                pass\n"),
        ("other-sites-let-in", "if any(origin not in own for origin in origins) or (", "if ("),
        (
            "foreign-hosts",
            "        except ValueError:\n            return False\n",
            "        except ValueError:\n            return True\n",
        ),
    ),
    ("lesson", "classroom/handlers.py"): (
        ("end-without-password", "        await self._check_password(client, password, now_s)\n        ", "        "),
        ("gifts-without-end", "        self._gifts.count(who, now_s)\n", ""),
        ("who-is-out-stays-on-the-mat", "            running.mat.leave(owner)\n", ""),
        ("a-key-works-twice", "            running.first_key = None\n", "            pass\n"),
        (
            "nobodys-pair-stays",
            "            self._room.part(lambda record: mend(record, number))\n",
            "            pass\n",
        ),
        ("a-slow-disk-hangs-up", "        running.show_changes()\n        for owner in", "        for owner in"),
        (
            "a-window-is-asked-for-early",
            "        def store() -> int:\n            # Asked when the thread's turn has come: meanwhile the window "
            "may be another's.\n            library = self._pairs.owned(who, pair, window).library\n",
            "        library = self._pairs.owned(who, pair, window).library\n\n        def store() -> int:\n",
        ),
        (
            "a-stop-waits-for-cars",
            "        self._room.stop_cars(True)\n        self._running.show_changes()\n        try:\n",
            "        try:\n            await self._stop.stop()\n            self._room.stop_cars(True)\n",
        ),
    ),
    ("lesson", "classroom/names.py"): (
        (
            "look-alikes",
            '    plain = unicodedata.normalize("NFKC", folded).translate(_LOOK_LIKE)',
            '    plain = unicodedata.normalize("NFKC", folded)',
        ),
    ),
    ("lesson", "server/studio/library.py"): (
        ("version-base-ignored", "            check_base(name, base, newest)\n", ""),
        ("other-stars-are-lost", "before | {mission: earned}", "{mission: earned}"),
    ),
    ("lesson", "server/studio/sessions.py"): (
        ("page-of-before-plays", "            if session.page is not page:\n                return\n", ""),
    ),
    ("lesson", "server/running.py"): (("a-letter-at-a-time", "came < _LEAST_BYTES", "came == 0"),),
    ("lesson", "server/studio/driving.py"): (
        ("a-reset-lifts-a-stop", ' and driven.control.telemetry().state != "stopped":', ":"),
    ),
    ("lesson", "drive/session.py"): (
        (
            "who-has-looked-for-long-loses-the-place",
            "            session.commanded_ms = self.clock()\n            session.has_place",
            "            session.has_place",
        ),
    ),
    ("lesson", "drive/client.py"): (
        ("a-release-is-overtaken", 'if self._has_released and you.get("drives"):', "if False:"),
    ),
    ("keys", "drive/server.py"): (
        ("revoked-stay-connected", "            channel.check_keys()\n", "            pass\n"),
    ),
    ("keys", "drive/channels.py"): (("revoked-come-in", "        self.check_keys()\n", "        pass\n"),),
    ("keys", "drive/keys.py"): (
        (
            "no-client-certificate",
            "    context.verify_mode = ssl.CERT_REQUIRED\n",
            "    context.verify_mode = ssl.CERT_NONE\n",
        ),
        ("list-needs-no-end", "        without_end(content)\n", "        pass\n"),
    ),
    ("fleet", "fleet/link.py"): (
        (
            "upload-lines-unbounded",
            "self._upload_lines > _MOST_LINES_OF_UPLOAD or self._upload_bytes > _MOST_BYTES_OF_UPLOAD",
            "False",
        ),
    ),
    ("fleet", "fleet/places.py"): (
        ("names-unsafe", '        if unicodedata.category(character)[0] not in "CZ" or character == " "\n', ""),
    ),
    ("uploads", "upload/serial_port.py"): (
        ("board-is-other", "description, hardware, name, BOARD)", "description, hardware, name, USB)"),
        ("several-ports-taken", "if len(likely) > 1:", "if False:"),
    ),
    ("track", "drive/stamps.py"): (
        ("late-answers-believed", "        if elapsed_ms(now, clock_ms) > _ANSWER_LASTS_MS:\n            return\n", ""),
        ("unstamped-after-stamped", "return not self._has_stamped", "return True"),
        ("old-behind-an-answer", " or later_ms > self._stale_ms:", ":"),
    ),
    ("track", "drive/session.py"): (
        (
            "switches-without-rate",
            "if not is_off and not session.rate.allows(now)",
            "if not is_off and isinstance(command, tuple) and not session.rate.allows(now)",
        ),
        ("switches-stay-on", "            self.switchboard.leave(session.number)\n", ""),
        ("a-stuck-loop-obeys-later", "                self.arbiter.delay()\n", ""),
        ("stops-are-not-logged", '        self._control.record("stops", self.name)\n', ""),
        (
            "ten-times-the-rate",
            "* _RATE_WINDOW_MS // 1000), _RATE_WINDOW_MS)",
            "* _RATE_WINDOW_MS // 100), _RATE_WINDOW_MS)",
        ),
        ("places-without-end", "< MOST_SESSIONS:", "< 100:"),
        ("nobody-arms", "profile.drive.hand_over_ms, profile.drive.arming)", "profile.drive.hand_over_ms, False)"),
    ),
    ("track", "drive/channels.py"): (
        ("a-stop-under-a-rate", 'if request.do != "stop" and not is_in_rate:', "if not is_in_rate:"),
        ("a-stop-waits-for-a-join", 'request.do not in ("join", "stop")', 'request.do != "join"'),
        ("one-word-is-believed", "_BELIEVED_WORDS = 2", "_BELIEVED_WORDS = 1"),
        ("anybodys-port", "if commands.client == self.client]", "]"),
        ("rubbish-stays-connected", "        self._hang_up(why)\n        return False", "        return False"),
    ),
    ("track", "drive/motors.py"): (
        (
            "a-refused-stop-is-forgotten",
            "                self.board.neutral()\n                self.is_neutral = not self._is_programmed",
            "                self.is_neutral = not self._is_programmed\n                self.board.neutral()",
        ),
        ("a-flat-battery-drives", "            arbiter.discharge()\n", "            pass\n"),
        ("obstacles-behind", "if wanted > 0 else None", "if wanted < 0 else None"),
    ),
    ("track", "drive/wire.py"): (
        (
            "the-oldest-counts",
            "{word >> _CODE_AT: index for index, word in enumerate(words)}",
            "{word >> _CODE_AT: index for index, word in reversed(list(enumerate(words)))}",
        ),
    ),
    ("track", "drive/client.py"): (
        ("a-silent-car-is-never-left", "if self._silent_s() > _LOST_S:", "if False:"),
        ("a-client-sends-into-silence", " or self._silent_s() > _SILENT_S:", ":"),
        (
            "a-stick-survives-a-stop",
            '        """Emergency stop: nothing moves until `clear`."""\n        self._switch.order()\n',
            '        """Emergency stop: nothing moves until `clear`."""\n',
        ),
    ),
    ("track", "drive/deadman.py"): (
        (
            "a-command-is-repeated-for-long",
            "> self._fresh_ms:\n            self._take(NOTHING)",
            "> 5 * self._fresh_ms:\n            self._take(NOTHING)",
        ),
    ),
    ("track", "drive/listener.py"): (
        ("connections-of-one-without-end", "len(alike) < places.most_of_one_address and len", "len"),
    ),
    ("shelf", "fleet/cars.py"): (
        (
            "named-later-not-stopped",
            "        if self._ordered:\n            contact.order(self._ordered)\n        self.contacts[at]",
            "        self.contacts[at]",
        ),
        (
            "who-answers-gives-way",
            "(found for found in reversed(most.values()) if not found.has_answered)",
            "(found for found in reversed(most.values()))",
        ),
        ("left-out-and-whole", "        self._was_left_out = True", "        pass"),
        ("untried-and-whole", "if self._was_left_out or self._has_untried() or", "if self._was_left_out or"),
        (
            "away-and-skipped",
            "if skips and status.crc32 == skips and not status.away:",
            "if skips and status.crc32 == skips:",
        ),
        ("the-first-of-two-names", "if len(found) > 1:", "if len(found) > 9:"),
        (
            "announced-as-a-class",
            "            self._cars.add(place)\n",
            "            if kind not in (CLASS, STUDIO):\n                self._cars.add(place)\n",
        ),
        (
            "a-named-place-is-forgotten",
            "if address in self.contacts and self.contacts[address].place.found:",
            "if address in self.contacts:",
        ),
        (
            "announced-names-count",
            "if name in (contact.place.address, contact.name)]",
            "if name in (contact.place.address, contact.name, contact.place.name)]",
        ),
        ("any-name-for-a-car", "            check_name(new)\n", "            pass\n"),
    ),
    ("shelf", "fleet/contact.py"): (
        ("any-answer-confirms-a-stop", "if orders == self._orders and not", "if not"),
        ("away-too-late", "MISSES = 3", "MISSES = 30"),
        ("forgotten-at-its-cable", "link.heard or self.has_answered", "link.heard"),
        (
            "never-away-again",
            "silent_s is None or silent_s > AWAY_S or not (self._link or self._loads)",
            "silent_s is None",
        ),
        (
            "drive-servers-not-stopped",
            "                            await client.stop()\n",
            "                            pass\n",
        ),
        (
            "number-in-another-base",
            'number=_number(fields.get("number"), 16)',
            'number=_number(fields.get("number"), 10)',
        ),
    ),
    ("shelf", "upload/transfer.py"): (
        ("another-program-is-verified", "if self._held == crc32(self._image):", "if self._held != held_first:"),
        (
            "neither-said-as-old",
            "            self.holds = NEITHER\n            if self._held == held_first:\n",
            "            if True:\n",
        ),
        (
            "no-silence-before-an-image",
            "yield from self._settle(SETTLE_MS)\n            self._last = ",
            "self._last = ",
        ),
        (
            "an-old-car-s-refusal-says-nothing",
            "                self.holds = held\n                return\n",
            "                return\n",
        ),
        ("sent-before-it-is", "                sent(count)\n", "                sent(len(data))\n"),
    ),
    ("shelf", "upload/serial_port.py"): (
        ("a-port-is-shared", "exclusive=True", "exclusive=False"),
        ("files-are-ports", "return stat.S_ISCHR(found.st_mode) and (", "return ("),
    ),
}
BREAKS = tuple(Break(each[0], *place, *each[1:]) for place, breaks in _PLACES.items() for each in breaks)
