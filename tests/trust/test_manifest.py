"""A manifest finds every change of a folder, says who vouches for it, and is itself believed only in its one form."""

from __future__ import annotations

import io
import json
import os
import shutil
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stillhook.base.gateway.inputs import collecting
from stillhook.base.kept.sealed import sealed
from stillhook.errors import TrustError
from stillhook.trust import results
from stillhook.trust.archive import OUTSIDE
from stillhook.trust.comparison import Comparison, compare, sign_parts
from stillhook.trust.keys import SigningKey, new_key, write_key
from stillhook.trust.manifest import IN_ARCHIVE, NAME, Made, Manifest, Part, read_manifest
from stillhook.trust.results import note_misfit, result_folder, with_renewed_parts
from stillhook.trust.standing import Standing
from stillhook.trust.trust_list import TrustedKey, TrustList

KEY, OTHER = new_key("Rig team"), new_key("Somebody")
TRUST = TrustList(Path("none")).trusting(TrustedKey.of("Rig team", KEY.public))
PARTS = {"plan.nc": b"numbers", "report.html": b"<p>words</p>", "figure.png": b"picture"}


def written(folder: Path, key: SigningKey | None = KEY, what: str = "plan", parts: dict[str, bytes] = PARTS) -> Path:
    """A folder of results."""
    with result_folder(folder, what, [("crane-1", "abc")], key=key) as part:
        for name, data in parts.items():
            (part / name).write_bytes(data)
    return folder


def lines(result: Comparison) -> tuple[tuple[str, ...], ...]:
    return result.missing, result.changed, result.added


def test_a_folder_is_complete_as_it_was_written(tmp_path: Path):
    result = compare(written(tmp_path / "o"), TRUST)
    assert result.holds
    assert set(result.manifest.parts) == PARTS.keys()
    (made,) = result.manifest.sets
    assert (made.what, made.cranes) == ("plan", (("crane-1", "abc"),))
    assert compare(tmp_path / "o" / NAME, TRUST).holds


def test_written_twice_and_signed_twice_it_has_the_same_bytes(tmp_path: Path):
    first = (written(tmp_path / "a") / NAME).read_bytes()
    assert (written(tmp_path / "b") / NAME).read_bytes() == first
    assert (written(tmp_path / "a") / NAME).read_bytes() == first
    sign_parts(tmp_path / "a", KEY)
    assert (tmp_path / "a" / NAME).read_bytes() == first


@pytest.mark.parametrize("name", PARTS)
def test_every_part_that_is_edited_deleted_or_linked_is_found(tmp_path: Path, name: str):
    file = written(tmp_path / "o") / name
    data = file.read_bytes()
    file.write_bytes(bytes([data[0] ^ 1]) + data[1:])  # the same size
    assert lines(compare(tmp_path / "o", TRUST)) == ((), (name,), ())
    file.write_bytes(data + b"\n")
    assert lines(compare(tmp_path / "o", TRUST)) == ((), (name,), ())
    file.unlink()
    assert lines(compare(tmp_path / "o", TRUST)) == ((name,), (), ())
    (tmp_path / "elsewhere").write_bytes(data)
    file.symlink_to(tmp_path / "elsewhere")
    assert lines(compare(tmp_path / "o", TRUST)) == ((), (name,), ())


def test_parts_that_are_added_renamed_or_swapped_are_found(tmp_path: Path):
    folder = written(tmp_path / "o")
    (folder / "figures").mkdir()
    (folder / "figures" / "b.png").write_bytes(b"other")
    assert lines(compare(folder, TRUST)) == ((), (), ("figures/b.png",))
    (folder / "figures" / "b.png").unlink()
    (folder / "plan.nc").rename(folder / "plan2.nc")
    assert lines(compare(folder, TRUST)) == (("plan.nc",), (), ("plan2.nc",))
    (folder / "report.html").rename(folder / "plan.nc")
    (folder / "plan2.nc").rename(folder / "report.html")
    assert lines(compare(folder, TRUST)) == ((), ("plan.nc", "report.html"), ())


def test_the_signed_manifest_of_another_folder_fits_nothing(tmp_path: Path):
    folder = written(tmp_path / "o")
    other = written(tmp_path / "p", parts={"plan.nc": b"better numbers"})
    shutil.copy(folder / NAME, other / NAME)
    result = compare(other, TRUST)
    assert result.judgement.trusted
    assert not result.holds
    assert lines(result) == (("figure.png", "report.html"), ("plan.nc",), ())


@pytest.mark.parametrize(
    ("key", "standing"), [(None, Standing.UNSIGNED), (OTHER, Standing.UNKNOWN), (KEY, Standing.TRUSTED)]
)
def test_only_a_trusted_key_vouches(tmp_path: Path, key: SigningKey | None, standing: Standing):
    result = compare(written(tmp_path / "o", key), TRUST)
    assert result.complete
    assert result.judgement.standing is standing
    assert result.holds is (key is KEY)


def test_an_edited_part_with_its_hash_made_again_loses_the_signature(tmp_path: Path):
    folder = written(tmp_path / "o")
    (folder / "plan.nc").write_bytes(b"better numbers")
    data = json.loads((folder / NAME).read_text())
    better = Part.of(b"better numbers")
    data["sets"][0]["parts"]["plan.nc"] = {"size": better.size, "sha256": better.sha256}
    (folder / NAME).write_text(sealed(data))
    result = compare(folder, TRUST)
    assert result.complete
    assert result.judgement.standing is Standing.ALTERED
    assert not result.holds


ODD_NAMES = (
    "../up",
    "a/../../up",
    "/etc/passwd",
    "a\\b",
    "c:x",
    "",
    ".",
    "a//b",
    "./a",
    "a\nb",
    NAME,
    IN_ARCHIVE,
    "x" * 500,
)


@pytest.mark.parametrize("name", ODD_NAMES)
def test_a_name_outside_the_folder_is_refused_in_one_line(tmp_path: Path, name: str):
    folder = written(tmp_path / "o")
    data = json.loads((folder / NAME).read_text())
    data["sets"][0]["parts"][name] = {"size": 1, "sha256": "0" * 64}
    (folder / NAME).write_text(sealed(data))
    with pytest.raises(TrustError, match=r"^[^\n]*not a manifest[^\n]*$"):
        compare(folder, TRUST)


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data["sets"].append(data["sets"][0]),
        lambda data: data["sets"].append({**data["sets"][0], "what": "x"}),
        lambda data: data.update(sets=3),
        lambda data: data.update(more=1),
        lambda data: data["sets"][0].update(parts=[]),
        lambda data: data["sets"][0].update(what=""),
        lambda data: data["sets"][0]["parts"].update(x={"size": -1, "sha256": "0" * 64}),
        lambda data: data["sets"][0]["parts"].update(x={"size": True, "sha256": "0" * 64}),
        lambda data: data["sets"][0]["parts"].update(x={"size": 1, "sha256": "0"}),
        lambda data: data["sets"][0]["parts"].update(x=None),
        lambda data: data["sets"][0].update(more=1),
        lambda data: data["sets"][0].pop("code"),
        lambda data: data["sets"][0].update(inputs=[]),
        lambda data: data["sets"][0].update(inputs={"a.toml": "0" * 64}),
        lambda data: data["sets"][0].update(inputs=[{"name": "a.toml", "sha256": "0"}]),
        lambda data: data["sets"][0].update(inputs=[{"name": "a\nb", "sha256": "0" * 64}]),
        lambda data: data["sets"][0].update(inputs=[{"name": "a", "sha256": "0" * 64}] * 2),
        lambda data: data.update(signature={}),
    ],
)
def test_a_manifest_of_another_form_is_one_line(tmp_path: Path, change: Callable[[dict], None]):
    folder = written(tmp_path / "o")
    data = json.loads((folder / NAME).read_text())
    change(data)
    (folder / NAME).write_text(sealed(data))
    with pytest.raises(TrustError, match=r"^[^\n]*not a manifest[^\n]*$"):
        compare(folder, TRUST)


@pytest.mark.parametrize("text", ["", "{}", "[" * 100_000, " " * 60_000_000, '{"format": "stillhook manifest 9"}'])
def test_a_file_that_is_no_manifest_is_one_line(tmp_path: Path, text: str):
    folder = written(tmp_path / "o")
    (folder / NAME).write_text(text)
    with pytest.raises(TrustError, match=r"^[^\n]+$"):
        compare(folder, TRUST)


def test_a_manifest_of_too_many_parts_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder = written(tmp_path / "o")
    monkeypatch.setattr("stillhook.trust.manifest.MOST_PARTS", 2)
    with pytest.raises(TrustError, match="more than 2 parts"):
        read_manifest(folder / NAME)


def test_two_commands_share_a_folder(tmp_path: Path):
    folder = written(tmp_path / "o")
    written(folder, what="lowering", parts={"lowering.nc": b"series"})
    result = compare(folder, TRUST)
    assert result.holds
    assert {made.what: sorted(of) for made, of in result.manifest.sets.items()} == {
        "lowering": ["lowering.nc"],
        "plan": sorted(PARTS),
    }


def test_nobody_signs_for_what_another_wrote(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    folder = written(tmp_path / "o", OTHER)
    written(folder, what="lowering", parts={"lowering.nc": b"series"})
    result = compare(folder, TRUST)
    assert result.complete
    assert result.judgement.standing is Standing.UNSIGNED
    assert "not signed, as figure.png was there before" in caplog.text


def test_a_change_before_the_next_command_is_still_seen_after_it(tmp_path: Path):
    folder = written(tmp_path / "o")
    (folder / "plan.nc").write_bytes(b"better numbers")
    written(folder, what="lowering", parts={"lowering.nc": b"series"})
    assert lines(compare(folder, TRUST)) == ((), ("plan.nc",), ())


def test_a_damaged_manifest_is_replaced_with_a_line_and_vouches_for_nothing_old(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    folder = written(tmp_path / "o")
    (folder / NAME).write_text("{}")
    written(folder, what="lowering", parts={"lowering.nc": b"series"})
    assert compare(folder, TRUST).added == tuple(sorted(PARTS))
    assert "replaced by one of the new files alone" in caplog.text


def test_only_what_is_as_written_is_signed(tmp_path: Path):
    folder = written(tmp_path / "o", None)
    (folder / "plan.nc").write_bytes(b"better numbers")
    with pytest.raises(TrustError, match=r"plan\.nc is not what the manifest says"):
        sign_parts(folder, KEY)


def test_a_part_that_is_signed_again_is_entered(tmp_path: Path):
    folder = written(tmp_path / "o")
    anew = {folder / "plan.nc": b"the same, signed"}
    for path, data in with_renewed_parts(anew, KEY).items():
        path.write_bytes(data)
    assert compare(folder, TRUST).holds
    for path, data in with_renewed_parts(anew, OTHER).items():
        path.write_bytes(data)
    assert compare(folder, TRUST).judgement.standing is Standing.UNSIGNED
    assert "not there" not in with_renewed_parts({folder / "not there": b""}, KEY)[folder / NAME].decode()


def test_reading_a_part_that_does_not_fit_is_noted(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    file = written(tmp_path / "o") / "plan.nc"
    note_misfit(file)
    assert caplog.text == ""
    file.write_bytes(b"better!")
    note_misfit(file)
    assert "plan.nc: is not what the manifest of its folder says" in caplog.text


def test_what_follows_from_a_changed_part_is_not_signed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("STILLHOOK_CONFIG", str(tmp_path / "home"))
    write_key(KEY, tmp_path / "home" / "key.pem", tmp_path / "home" / "public.pem")
    file = written(tmp_path / "o") / "plan.nc"

    def standing(name: str) -> Standing:
        with collecting({}):
            note_misfit(file)
            return compare(written(tmp_path / name, None), TRUST).judgement.standing

    assert standing("of-what-was-written") is Standing.TRUSTED
    file.write_bytes(b"better!")
    assert standing("of-what-was-changed") is Standing.UNSIGNED
    assert f"not signed, as {file} is not what a manifest says" in caplog.text
    with collecting({}):  # another command, which does not read it
        assert compare(written(tmp_path / "of-nothing", None), TRUST).holds


def test_a_key_that_needs_a_passphrase_costs_no_result(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("STILLHOOK_CONFIG", str(tmp_path / "home"))
    monkeypatch.delenv("STILLHOOK_PASSPHRASE", raising=False)
    write_key(KEY, tmp_path / "home" / "key.pem", tmp_path / "home" / "public.pem", "word")
    assert compare(written(tmp_path / "o", None), TRUST).judgement.standing is Standing.UNSIGNED
    assert "Manifests are not signed" in caplog.text
    monkeypatch.setenv("STILLHOOK_PASSPHRASE", "word")
    assert compare(written(tmp_path / "p", None), TRUST).holds


def test_a_failed_write_leaves_folder_and_manifest_as_they_were(tmp_path: Path):
    folder = written(tmp_path / "o")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    def fail() -> None:
        with result_folder(folder, "plan", key=KEY) as part:
            (part / "plan.nc").write_bytes(b"half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def of_archive(key: SigningKey | None) -> bytes:
    """Its manifest."""
    parts = {name: Part.of(data) for name, data in PARTS.items()}
    return Manifest({Made.of("FMU"): parts}).signed(key).text().encode()


@pytest.fixture
def archive(tmp_path: Path) -> Callable[..., Path]:
    """A zip file with its manifest, and members written besides."""

    def make(more: dict[str, bytes] | None = None, without: str = "", twice: str = "") -> Path:
        members = {**PARTS, IN_ARCHIVE: of_archive(KEY), **(more or {})}
        with zipfile.ZipFile(tmp_path / "a.fmu", "w") as out:
            for name, data in members.items():
                if name != without:
                    out.writestr(name, data)
            if twice:
                with pytest.warns(UserWarning, match="Duplicate name"):
                    out.writestr(twice, members[twice])
        return tmp_path / "a.fmu"

    return make


def test_an_archive_is_compared_as_a_folder_is(archive: Callable[..., Path]):
    assert compare(archive(), TRUST).holds
    assert lines(compare(archive({"plan.nc": b"NUMBERS"}), TRUST)) == ((), ("plan.nc",), ())
    assert lines(compare(archive({"../up": b""}), TRUST)) == ((), (), ("../up",))
    assert lines(compare(archive(without="plan.nc"), TRUST)) == (("plan.nc",), (), ())
    assert lines(compare(archive(twice="plan.nc"), TRUST)) == ((), ("plan.nc",), ())


def streamed(content: bytes) -> bytes:
    """An archive of the same members, written without a seek, so that checksums and sizes follow them."""

    class Pipe(io.RawIOBase):
        data = b""

        def writable(self) -> bool:
            return True

        def write(self, more: Any) -> int:
            self.data += bytes(more)
            return len(more)

    pipe = Pipe()
    with zipfile.ZipFile(io.BytesIO(content)) as before, zipfile.ZipFile(pipe, "w", zipfile.ZIP_DEFLATED) as after:
        for each in before.infolist():
            after.writestr(each.filename, before.read(each))
    return pipe.data


def commented(content: bytes) -> bytes:
    stream = io.BytesIO(content)
    with zipfile.ZipFile(stream, "a") as out:
        out.comment = b"MZ"
    return stream.getvalue()


def apart(content: bytes) -> bytes:
    """With bytes between members and their list, whose place is corrected."""
    (begin,) = struct.unpack("<I", content[-6:-2])
    return content[:begin] + b"MZ" + content[begin:-6] + struct.pack("<I", begin + 2) + content[-2:]


@pytest.mark.parametrize("change", [lambda b: b"MZ" + b, lambda b: b + b"MZ", commented, apart])
def test_bytes_outside_of_the_members_of_an_archive_are_said(archive: Callable[..., Path], change: Any):
    file = archive()
    file.write_bytes(change(file.read_bytes()))
    assert lines(compare(file, TRUST)) == ((), (), (OUTSIDE,))
    sign_parts(file, KEY)  # which writes the members anew
    assert compare(file, TRUST).holds


def test_an_archive_of_another_program_is_compared_as_well(archive: Callable[..., Path]):
    file = archive()
    file.write_bytes(streamed(file.read_bytes()))
    assert compare(file, TRUST).holds


def test_an_archive_without_its_one_manifest_is_one_line(archive: Callable[..., Path], tmp_path: Path):
    for file in (archive(without=IN_ARCHIVE), archive(twice=IN_ARCHIVE), archive({IN_ARCHIVE: b"{}"})):
        with pytest.raises(TrustError, match=r"^[^\n]+$"):
            compare(file, TRUST)
    (tmp_path / "a.fmu").write_bytes(b"PK no zip")
    for path in ("a.fmu", "gone.fmu", "gone"):
        with pytest.raises(TrustError, match=r"^[^\n]+$"):
            compare(tmp_path / path, TRUST)


def test_an_archive_is_signed_afterwards_with_the_bytes_that_it_has_signed_at_once(archive: Callable[..., Path]):
    signed = archive({"note.txt": b"added"}).read_bytes()
    file = archive({"note.txt": b"added", IN_ARCHIVE: of_archive(None)})
    assert compare(file, TRUST).judgement.standing is Standing.UNSIGNED
    sign_parts(file, KEY)
    assert [(each.filename, each.CRC, each.date_time) for each in zipfile.ZipFile(file).infolist()] == [
        (each.filename, each.CRC, each.date_time) for each in zipfile.ZipFile(io.BytesIO(signed)).infolist()
    ]
    assert lines(compare(file, TRUST)) == ((), (), ("note.txt",))
    assert compare(file, TRUST).judgement.trusted
    once = file.read_bytes()
    sign_parts(file, KEY)
    assert file.read_bytes() == once


@pytest.mark.parametrize("odd", [{"more": {"plan.nc": b"NUMBERS"}}, {"twice": "plan.nc"}, {"without": "plan.nc"}])
def test_an_archive_of_other_parts_is_not_signed_and_stays_as_it_is(archive: Callable[..., Path], odd: dict[str, Any]):
    file = archive(**odd)
    before = file.read_bytes()
    with pytest.raises(TrustError, match=r"^[^\n]*plan\.nc is not what the manifest says[^\n]*$"):
        sign_parts(file, OTHER)
    assert file.read_bytes() == before


def test_an_archive_that_unpacks_to_too_much_is_refused(archive: Callable[..., Path], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("stillhook.trust.archive.LARGEST", 1000)
    with pytest.raises(TrustError, match="unpacked larger"):
        compare(archive({"big": bytes(2000)}), TRUST)


def test_folders_of_results_are_written_in_one_way():
    """A new output has its manifest for nothing: only what a user is to edit is written without."""
    package = Path(results.__file__).parents[1]
    users = {p.relative_to(package).as_posix() for p in package.rglob("*.py") if "atomic_folder" in p.read_text()}
    assert users == {"base/atomic.py", "trust/results.py", "library/examples.py", "plan/file.py"}


@pytest.mark.skipif(os.name == "nt", reason="devices are files elsewhere")
def test_a_device_in_place_of_a_part_is_not_read(tmp_path: Path):
    folder = written(tmp_path / "o")
    (folder / "plan.nc").unlink()
    os.mkfifo(folder / "plan.nc")
    assert lines(compare(folder, TRUST)) == ((), ("plan.nc",), ())
