"""Ways to break the code: as it once was, or could be. `tests.faults.breaks` tries them."""

from typing import NamedTuple


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


BREAKS = (
    # Uploads.
    Break("no-fsync", "uploads", "config/files.py", "os.fsync(file.fileno())", "pass"),
    Break("no-fsync-of-the-folder", "uploads", "config/files.py", "    _keep_names(path.parent)\n", "    pass\n"),
    Break(
        "folder-errors-ignored",
        "uploads",
        "config/files.py",
        "if problem.errno in _FAILURES:",
        "if problem.errno in ():",
    ),
    Break("written-in-place", "uploads", "config/files.py", "temporary.replace(path)", "path.write_bytes(data)"),
    Break("rubbish-stays", "uploads", "config/files.py", "temporary.unlink(missing_ok=True)", "pass"),
    Break("uploads-spliced", "uploads", "words/receiver.py", "    if count > 0 and is_empty_image == 0:", "    if 0:"),
    Break(
        "any-checksum-taken", "uploads", "words/receiver.py", "if r[IS_ANNOUNCED] and r[CRC] != r[ANNOUNCED]:", "if 0:"
    ),
    Break(
        "answers-before-it-stores",
        "uploads",
        "car/loop.py",
        "            self._answers += error_line(CANT_STORE)\n            return\n",
        "            pass\n",
    ),
    Break(
        "holds-old-said-too-early",
        "uploads",
        "upload/transfer.py",
        "outcome = yield from self._send_image(EITHER)",
        "outcome = yield from self._send_image(OLD)",
    ),
    Break("no-settling", "uploads", "upload/transfer.py", "SETTLE_MS = upload.SILENCE_MS + 100", "SETTLE_MS = 0"),
    Break(
        "a-bad-line-for-an-old-car",
        "uploads",
        "upload/transfer.py",
        "    if len(reasons) < 2 or set(reasons) != {reason} or not reason or reason",
        "    if False and reason",
    ),
    Break(
        "a-lost-port-stays-lost",
        "uploads",
        "boards/lines.py",
        "            self._last_try_s = now_s\n",
        "            return None\n",
    ),
    Break(
        "a-mute-client-keeps-the-port",
        "uploads",
        "boards/on_chip/wifi_line.py",
        "if not data and (uploader.is_gone or elapsed_ms(self._now_ms(), uploader.last_byte_ms) >= _IDLE_MS):",
        "if not data and uploader.is_gone:",
    ),
    # Driving.
    Break(
        "failsafe-too-late",
        "driving",
        "car/arbiter.py",
        "        if silent_ms <= self._failsafe_ms:\n            return self._failsafe_ms + 1 - silent_ms\n",
        "        if silent_ms <= 2 * self._failsafe_ms:\n            return 2 * self._failsafe_ms + 1 - silent_ms\n",
    ),
    Break("no-watchdog", "driving", "drive/server.py", "rest_ms = self._control.watch()", "rest_ms = 50"),
    Break(
        "guard-ignores-frozen",
        "driving",
        "drive/motor_guard.py",
        "if not has_report and self._last >= _MOVING:",
        "if False:",
    ),
    Break(
        "guard-ignores-killed",
        "driving",
        "drive/motor_guard.py",
        'return "dismissed" if self._last == _END else "killed"',
        'return "dismissed"',
    ),
    Break(
        "guard-begins-a-period-of-its-own",
        "driving",
        "drive/motor_guard.py",
        "wait_s = patience_s if last <= _MOVING else",
        "wait_s = patience_s if True else",
    ),
    Break(
        "frozen-guard-unnoticed",
        "driving",
        "drive/motor_guard.py",
        "elif now_s - asked_s > self._answer_s:",
        "elif False:",
    ),
    Break(
        "stop-needs-a-place",
        "driving",
        "drive/session.py",
        "        self._control.change(None, lambda arbiter, now: arbiter.stop())",
        "        self.take_place()\n        self._control.change(self, lambda arbiter, now: arbiter.stop())",
    ),
    Break("stop-only-of-the-driver", "driving", "car/arbiter.py", "    (MOVING, STOP, STOPPED),\n", ""),
    Break(
        "stamps-ignored",
        "driving",
        "drive/stamps.py",
        "        return later_ms <= self._stale_ms\n",
        "        return True\n",
    ),
    Break(
        "a-stamp-comes-round",
        "driving",
        "drive/stamps.py",
        "return self._fresh_ms is not None and self._now_ms - self._fresh_ms > _SILENCE_MS",
        "return False",
    ),
    Break(
        "first-command-believed",
        "driving",
        "drive/stamps.py",
        "        if self._can_ask and not self._was_answered:\n            return True\n",
        "",
    ),
    Break(
        "failsafe-needs-no-arming", "driving", "car/arbiter.py", "(MOVING, SILENT, FAILSAFE)", "(MOVING, SILENT, READY)"
    ),
    Break(
        "a-lost-driver-needs-no-arming",
        "driving",
        "car/arbiter.py",
        "(MOVING, GONE, FAILSAFE)",
        "(MOVING, GONE, READY)",
    ),
    Break("two-drivers", "driving", "car/arbiter.py", "return self.driver in (session, NOBODY)", "return True"),
    Break(
        "who-is-gone-drives-on",
        "driving",
        "drive/channels.py",
        "        self.line = None\n        self.own.leave()\n",
        "        self.line = None\n",
    ),
    Break(
        "a-held-stick-drives-again", "driving", "drive/deadman.py", "(DRIVING, LOST, LOCKED)", "(DRIVING, LOST, ARMING)"
    ),
    Break(
        "a-fault-is-forgotten",
        "driving",
        "drive/motors.py",
        "            arbiter.stall()\n            self._obey",
        "            self._obey",
    ),
    Break(
        "no-bound-of-answers",
        "driving",
        "drive/channels.py",
        "if self.line.get_write_buffer_size() > _MOST_WAITING_BYTES:",
        "if False:",
    ),
    Break(
        "no-bound-of-connections",
        "driving",
        "drive/listener.py",
        "        places, network = self._places, network_of(address)\n",
        "        return True\n        places, network = self._places, network_of(address)\n",
    ),
    Break(
        "the-horn-goes-on",
        "driving",
        "drive/motors.py",
        "        self._fresh_ms = fresh_ms\n",
        "        self._fresh_ms = 20 * fresh_ms\n",
    ),
    # A room of cars.
    Break(
        "old-after-a-broken-try", "fleet", "fleet/contact.py", "if transfer.holds != OLD or holds == AWAY:", "if True:"
    ),
    Break("unasked-and-away", "fleet", "fleet/contact.py", "if self._loads or not is_asked:", "if self._loads:"),
    Break(
        "a-stop-waits-for-the-heartbeat",
        "fleet",
        "fleet/contact.py",
        "        if self._link:\n            self._send(self._link, kind)",
        "        pass",
    ),
    Break(
        "who-was-away-is-not-stopped",
        "fleet",
        "fleet/contact.py",
        "self._send(link, self.wanted or ASK)",
        "self._send(link, ASK)",
    ),
    Break(
        "found-cars-get-no-order",
        "fleet",
        "fleet/cars.py",
        "            if self._ordered:\n                contact.order(self._ordered)\n",
        "",
    ),
    Break(
        "the-dead-are-waited-for",
        "fleet",
        "fleet/contact.py",
        "async with asyncio.timeout(_BACK_S):",
        "async with asyncio.timeout(60 * _BACK_S):",
    ),
    Break(
        "one-waits-for-another",
        "fleet",
        "fleet/cars.py",
        "free = asyncio.Semaphore(_AT_ONCE)",
        "free = asyncio.Semaphore(1)",
    ),
    Break(
        "a-host-fills-the-list",
        "fleet",
        "fleet/cars.py",
        " >= _MOST_OF_A_HOST:\n            self.problem",
        " < 0:\n            self.problem",
    ),
    Break(
        "a-new-program-ends-a-stop",
        "fleet",
        "car/loop.py",
        "        if not self._is_stopped:\n            step.begin_program(self, now)",
        "        self._is_stopped = False\n        step.begin_program(self, now)",
    ),
    Break(
        "a-stop-waits-for-the-upload",
        "fleet",
        "boards/lines.py",
        "        had_some = False\n",
        "        had_some = False\n        if self._uploader is not None:\n            return False\n",
    ),
    Break(
        "unguarded-after-a-fault",
        "driving",
        "drive/motors.py",
        "        if not self._may_move:\n",
        "        if self.is_neutral:\n",
        first=961,
    ),
    Break(
        "a-horn-before-the-clock",
        "driving",
        "drive/client.py",
        "NEUTRAL))\n                return\n            self._connection.send(self._stamped(stick_word(*axes)))\n",
        "NEUTRAL))\n            else:\n                self._connection.send(self._stamped(stick_word(*axes)))\n",
        first=2514,
    ),
    Break("any-answer-confirms-a-stop", "fleet", "fleet/contact.py", " and orders == self._orders", "", first=3397),
    # A class.
    Break(
        "one-library-for-all",
        "class",
        "classroom/running.py",
        "lambda: self._ports(visitor), visitor)",
        'lambda: self._ports(visitor), "01")',
    ),
    Break(
        "answers-before-it-is-stored",
        "class",
        "classroom/app.py",
        "        await running.settle(since)\n",
        "        running.show_changes()\n",
    ),
    Break(
        "refused-and-done",
        "class",
        "classroom/running.py",
        "            self.room.restore(from_bytes(self._kept, RECORD))\n",
        "            pass\n",
    ),
    Break(
        "pupils-ask-as-teacher", "class", "classroom/app.py", "        if holder != TEACHER:\n", "        if False:\n"
    ),
    Break(
        "versions-in-place",
        "class",
        "server/studio/library.py",
        "replace_file(_file(folder, version), data)",
        "_file(folder, version).write_bytes(data)",
    ),
    Break(
        "devices-forgotten",
        "class",
        "classroom/room.py",
        "_MOST_DEVICES + 1 :], device]\n        self.save()\n",
        "_MOST_DEVICES + 1 :], device]\n",
    ),
    Break(
        "nobody-sees-the-stop",
        "class",
        "classroom/room.py",
        "        self.stopped = stopped\n        self.changes += 1\n",
        "        self.stopped = stopped\n",
    ),
    Break(
        "nobody-sees-the-freeze",
        "class",
        "classroom/room.py",
        "        self.frozen = frozen\n        self.changes += 1\n",
        "        self.frozen = frozen\n",
    ),
    Break(
        "undone-and-answered",
        "class",
        "classroom/running.py",
        "        if since <= self._undone:\n",
        "        if False:\n",
    ),
    Break(
        "two-store-at-once",
        "class",
        "classroom/running.py",
        "            async with self._storing:\n",
        "            if True:\n",
    ),
    Break(
        "the-other-pupil-comes-back",
        "class",
        "classroom/room.py",
        "if likeness(each.name) == alike), None)",
        "if alike), None)",
    ),
    Break(
        "drafts-in-place",
        "class",
        "classroom/folder.py",
        "replace_file(folder / DRAFT, data)",
        "(folder / DRAFT).write_bytes(data)",
    ),
)
