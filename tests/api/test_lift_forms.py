"""One lift file for every command: old forms are read and converted to the bit, and of a plan's phases those are run
that one run can follow."""

import json
import tomllib
from pathlib import Path

import pytest

import stillhook
from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.formats.lift.forms import changed, changes, converted, negative
from stillhook.formats.lift_file import lifts, load_lift
from stillhook.plan.file import plans
from stillhook.plan.result import _in_depths
from stillhook.spec.lift.phase import Phase
from stillhook.spec.lift.stored import lowerings_text, stored_lowerings

OLD = Path(__file__).with_name("old_forms")
NOTE = pytest.mark.filterwarnings("ignore:.*an old form:FutureWarning")
TOP = """\
crane = "nov-250t"
payload = "manifold-60t"
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "300 m"
"""


def top(start: str) -> str:
    return f'start_depth = "{start}"\n{TOP}'


def written(folder: Path, text: str, name: str = "lift.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(call, *arguments) -> str:
    with pytest.raises(StillhookError) as problem:
        call(*arguments)
    line = str(problem.value)
    assert "\n" not in line
    return line


class TestOldForms:
    @NOTE
    @pytest.mark.parametrize("name", ["anchor-to-3000m", "template-through-the-surface"])
    def test_a_lowering_is_the_same_read_old_converted_and_of_the_library(self, name, tmp_path):
        old = load_lift(OLD / f"{name}.toml", moving=False).lift
        new = written(tmp_path, converted((OLD / f"{name}.toml").read_text(encoding="utf-8"))[0])
        assert load_lift(new, moving=False).lift == old == load_lift(name, moving=False).lift

    @NOTE
    @pytest.mark.parametrize("name", ["manifold-recovery", "template-to-1500m"])
    def test_a_plan_is_the_same_read_old_converted_and_of_the_library(self, name, tmp_path):
        old = stillhook.load_plan(OLD / f"{name}.toml")
        new = written(tmp_path, converted((OLD / f"{name}.toml").read_text(encoding="utf-8"))[0])
        library = stillhook.load_plan(name)
        assert old.digest == stillhook.load_plan(new).digest == library.digest
        assert old.phases == library.phases

    @NOTE
    def test_an_old_plan_has_the_heights_that_it_says(self):
        phases = stillhook.load_plan(OLD / "template-to-1500m.toml").phases
        assert [(p.z_start, p.z_end, p.duration) for p in phases] == [
            (4.0, 7.0, 30.0),
            (7.0, 7.0, 600.0),
            (7.0, -25.0, 128.0),
            (-25.0, -600.0, 1150.0),
            (-600.0, -1475.0, 875.0 / 0.3),
            (-1475.0, -1475.0, 1800.0),
            (-1497.0, -1497.0, 300.0),
            (-1475.0, -1500.0, 250.0),
        ]

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            (
                'start = "3 m"\n[[stage]]\nmode = "ahc"\nlower = "6 m/min"\ndepth = "20 m"',
                'start_depth = "-3 m"\n[[phase]]\nmode = "ahc"\nspeed = "6 m/min"\ndepth = "20 m"',
            ),
            (
                'start = "-50 m"\n[[stage]]\nmode = "ahc"\nlower = "-6 m/min"\ndepth = "-2 m"',
                'start_depth = "50 m"\n[[phase]]\nmode = "ahc"\nspeed = "-6 m/min"\ndepth = "-2 m"',
            ),
            (
                '[[stage]]\nmode = "landing"\nlower = "6 m/min"\nhold = "9 kN"\ntension = "5 kN"',
                '[[phase]]\nmode = "landing"\nspeed = "6 m/min"\ntension = "9 kN"\nend_tension = "5 kN"',
            ),
            (
                '[[stage]]\nmode = "manual"\nlower = "-6 m/min"\nwire = "20 m"',
                '[[phase]]\nmode = "manual"\nspeed = "-6 m/min"\nwire = "20 m"',
            ),
            (
                '[[phase]]\nkind = "lift-off"\nstart = "4 m"\nend = "7 m"',
                'start_depth = "-4 m"\n[[phase]]\nkind = "lift-off"\ndepth = "-7 m"',
            ),
            (
                '[[phase]]\nkind = "landing"\nend = "-300 m"\nhold = "5 min"',
                '[[phase]]\nkind = "landing"\ndepth = "300 m"\nhold = "5 min"',
            ),
            (
                '[[phase]]\nkind = "deep"\nstart = "-280 m"\nduration = "5 min"',
                'start_depth = "280 m"\n[[phase]]\nkind = "deep"\ntime = "5 min"',
            ),
            ('[[phase]]\nkind = "in-air"\nduration = "5 min"', '[[phase]]\nkind = "in-air"\ntime = "5 min"'),
            (
                '[[phase]]\nkind = "in-air"\nend = "7 m"\nduration = "5 min"',
                '[[phase]]\nkind = "in-air"\ndepth = "-7 m"\nplanned = "5 min"',
            ),
            (
                '[[phase]]\nkind = "splash-zone"\nduration = "5 min"',
                '[[phase]]\nkind = "splash-zone"\nplanned = "5 min"',
            ),
            (  # a start after no end is that end
                '[[phase]]\nkind = "splash-zone"\n[[phase]]\nkind = "deep"\nstart = "-28 m"',
                '[[phase]]\nkind = "splash-zone"\ndepth = "28 m"\n[[phase]]\nkind = "deep"',
            ),
            (
                '[[phase]]\nkind = "splash-zone"\nend = "-28 m"\n[[phase]]\nkind = "deep"\nstart = "-28 m"',
                '[[phase]]\nkind = "splash-zone"\ndepth = "28 m"\n[[phase]]\nkind = "deep"',
            ),
        ],
    )
    def test_every_word_that_changes_its_name_or_sign(self, old, new):
        assert changed(tomllib.loads(old), changes(tomllib.loads(old))) == tomllib.loads(new)
        text, said = converted(old)
        assert tomllib.loads(text) == tomllib.loads(new)
        assert said

    def test_what_is_of_today_stays(self):
        new = 'start_depth = "-3 m"\n[[phase]]\nkind = "landing"\nhold = "5 min"\ntension = "5 kN"\n'
        assert changes(tomllib.loads(new)) == ()
        assert "already" in refused(converted, new)

    def test_a_height_is_a_depth_in_its_own_unit(self):
        rows = {
            "4 m": "-4 m",
            "-25 m": "25 m",
            "+2.5 km": "-2.5 km",
            "0 m": "0 m",
            "-0.0 m": "0.0 m",
            " -1e1 cm ": "1e1 cm",
        }
        assert {old: negative(old, "start") for old in rows} == rows
        for odd in (4, "4", "4 kg", "nan m"):  # a depth of its text would have the height's sign
            with pytest.raises(StillhookError, match=r"^start = "):
                negative(odd, "start")

    @pytest.mark.parametrize(
        ("text", "old", "new"),
        [
            ('start = "3 m"\n[[phase]]\nmode = "ahc"\ntime = "5 s"', "start", "[[phase]]"),
            ('start_depth = "3 m"\n[[stage]]\nmode = "ahc"\ntime = "5 s"', "[[stage]]", "start_depth"),
            ('[[stage]]\nname = "a"\nmode = "ahc"\nspeed = "5 m/min"', "[[stage]]", 'stage "a": speed'),
            ('[[phase]]\nname = "a"\nkind = "deep"\nend = "-5 m"\ntime = "5 s"', 'phase "a": end', 'phase "a": time'),
            ('start_depth = "3 m"\n[[phase]]\nkind = "lowering"\nend = "-5 m"', "phase 1: end", "start_depth"),
            ('[[phase]]\nmode = "ahc"\nlower = "5 m/min"\ntime = "5 s"', "phase 1: lower", "phase 1: "),
        ],
    )
    def test_a_file_that_mixes_both_names_a_word_of_each(self, text, old, new):
        line = refused(changes, tomllib.loads(text))
        assert line.startswith(f"{old} is of the old form, and {new}")

    def test_old_phases_that_do_not_join_are_refused(self):
        text = '[[phase]]\nkind = "lowering"\nend = "-26 m"\n[[phase]]\nname = "deep"\nkind = "deep"\nstart = "-25 m"'
        assert 'phase "deep": starts at -25 m, and the one before it ends at -26 m' in refused(converted, text)

    def test_phases_in_one_line_are_read_and_not_converted(self, tmp_path):
        text = f'start = "3 m"\nstage = [{{ mode = "ahc", time = "60 s" }}]\n{TOP}'
        with pytest.warns(FutureWarning, match="an old form"):
            assert load_lift(written(tmp_path, text), moving=False).lift.start_depth == -3.0
        assert "[[stage]]" in refused(converted, text)

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ('start = 3\n[[stage]]\nmode = "ahc"\ntime = "5 s"', "start = 3: "),
            ('[[phase]]\nkind = "lowering"\nend = -30', 'phase "lowering": end = -30: '),
            (
                'start = "2.5 m"\n[[stage]]\nmode = "manual"\nlower = "6 m/min"\ndepth = "-20 m"',
                "Turn the sign of lower",
            ),
            ('start = "2 m"\n[[stage]]\nmode = "manual"\nlower = "-6 m/min"\ndepth = "9 m"', "Turn the sign of lower"),
        ],
    )
    def test_a_sign_that_cannot_be_turned_is_refused_before_anything_is_written(self, text, says):
        assert says in refused(converted, text)

    @NOTE
    @pytest.mark.parametrize(
        ("rows", "says"),
        [
            (
                '[[stage]]\nmode = "ahc"\nlower = "6 furlongs"\ntime = "5 s"',
                'lift.toml: stage 1: lower = "6 furlongs": unit "furlongs"',
            ),
            (
                '[[stage]]\nname = "a"\nmode = "landing"\nlower = "6 m/min"\nhold = "3 t"\ntime = "5 s"',
                'stage "a": hold = "3 t"',
            ),
            ('[[stage]]\nmode = "ahk"\ntime = "5 s"', 'stage 1: mode = "ahk"'),
            ('[[stage]]\nname = "a"\nmode = "ahk"\ntime = "5 s"', 'stage "a": mode = "ahk"'),
            (
                '[[stage]]\nmode = "landing"\nlower = "6 m/min"\ntension = "3 kN"',
                "In this file tension is",
            ),
            ('[[phase]]\nkind = "deep"\nduration = "-5 s"', 'phase 1: duration = "-5 s": it must be greater'),
        ],
    )
    def test_errors_name_the_keys_that_an_old_file_has(self, rows, says, tmp_path):
        top = TOP if "kind" in rows else f'start = "3 m"\n{TOP}'
        assert says in refused(load_lift, written(tmp_path, f"{top}{rows}\n"))

    def test_what_is_no_lift_file_is_not_called_one_of_today(self):
        assert "not a lift file" in refused(converted, 'base = "nov-250t"')

    def test_lowerings_stored_by_older_versions_are_read(self):
        land = Phase(mode="landing", speed="6 m/min", tension="100 kN", time="20 s")
        up = Phase(mode="ahc", speed="-6 m/min", end_tension="300 kN")
        lift = load_lift("anchor-to-3000m", moving=False).lift.model_copy(update={"programme": (land, up)})
        data = json.loads(lowerings_text([lift]))
        (row,) = data["lifts"]
        row["z_0"] = -row.pop("start_depth")
        of_today = {"lower": "speed", "hold": "tension", "tension": "end_tension"}
        same = ("name", "mode", "time", "depth", "wire", "landed", "timeout")
        row["programme"] = [
            {**{key: stage[key] for key in same}, **{old: stage[new] for old, new in of_today.items()}}
            for stage in row["programme"]
        ]
        (again,) = stored_lowerings(json.dumps(data))
        assert (again.start_depth, again.moves) == (lift.start_depth, lift.moves)
        assert [(p.tension, p.end_tension, p.ends) for p in again.programme] == [
            (p.tension, p.end_tension, p.ends) for p in lift.programme
        ]

    def test_plans_stored_by_older_versions_are_read(self):
        assert _in_depths({"name": "down", "start": None, "end": -25.0}) == {
            "name": "down",
            "start_depth": None,
            "depth": 25.0,
        }


class TestConvert:
    def test_comments_stay_and_every_change_is_printed(self, tmp_path, capsys):
        new = tmp_path / "folder" / "new.toml"
        assert (
            run(["convert", str(OLD / "template-to-1500m.toml"), str(new), "--verbose"]) == 0
        )  # its folder is made, as of --out
        out = capsys.readouterr().out
        assert 'phase "lift-off": start is start_depth = "-4 m" of the file' in out
        assert 'phase "deep": duration is time' in out
        text = new.read_text(encoding="utf-8")
        assert 'start_depth = "-4 m"  # the deck above still water' in text
        comments = [
            part.partition("#")[2] for part in (OLD / "template-to-1500m.toml").read_text(encoding="utf-8").splitlines()
        ]
        assert all(comment in text for comment in comments)

    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (("OLD", "new.nc"), "ends in .toml"),
            (("OLD", "there.toml"), "is there already"),
            (("OLD", "new.toml", "--case", "a"), "--case: belongs to a run or a log"),
            (("there.toml", "new.toml"), "is a crane file, not a lift file"),
            (("today.toml", "new.toml"), "in the words of today already"),
        ],
    )
    def test_what_cannot_be_converted_is_refused_in_one_line(self, arguments, says, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        written(tmp_path, 'base = "nov-250t"\nhook_mass = "3 t"\n', "there.toml")
        written(tmp_path, f'{top("3 m")}[[phase]]\nkind = "deep"\n', "today.toml")
        words = [str(OLD / "anchor-to-3000m.toml") if word == "OLD" else word for word in arguments]
        assert run(["convert", *words]) == 2
        err = capsys.readouterr().err
        assert says in err
        assert err.count("\n") == 1
        assert not (tmp_path / "new.toml").exists()


class TestOneFile:
    @pytest.mark.parametrize("name", lifts())
    def test_lower_response_and_payload_read_every_lift_of_the_library(self, name, capsys):
        assert load_lift(name, moving=False).sea is not None
        assert run(["payload", name, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["payload"] == load_lift(name, moving=False).lift.payload.name

    def test_a_lift_without_seas_to_analyse_is_refused_as_a_plan_in_one_line(self):
        assert "environment: missing (table [environment] with Hs, Tp and headings)" in refused(
            stillhook.load_plan, "anchor-to-3000m"
        )
        assert plans() == ("manifold-recovery", "template-to-1500m")

    @pytest.mark.parametrize(
        ("name", "first", "ends", "not_run"),
        [
            ("template-to-1500m", -7.0, [-7.0, 25.0, 600.0, 1475.0, 1475.0, None], "lift-off"),
            ("manifold-recovery", 380.0, [25.0, -7.0], "off the seabed, over the deck, set down"),
        ],
    )
    def test_of_a_plan_those_phases_are_run_that_one_run_can_follow(self, name, first, ends, not_run):
        file = load_lift(name, moving=False)
        assert file.lift.start_depth == first
        assert [move.end for move in file.lift.moves][: len(ends) - 1] == ends[: len(ends) - 1]
        assert any(note.endswith(f"and no deck: {not_run}") for note in file.notes)

    def test_a_hold_of_a_landing_is_a_stop_and_a_hold_of_the_splash_zone_is_not_run(self, tmp_path):
        rows = '[[phase]]\nkind = "splash-zone"\n[[phase]]\nkind = "lowering"\n'
        rows += '[[phase]]\nkind = "landing"\nhold = "2 min"\nstand_off = "4 m"\nspeed = "6 m/min"\n'
        file = load_lift(written(tmp_path, top("-5 m") + rows), moving=False)
        assert [(p.mode.value, p.ends, p.depth, p.time) for p in file.lift.programme[-3:]] == [
            ("ahc", ("depth",), 296.0, None),
            ("ahc", ("time",), None, 120.0),
            ("landing", ("time",), None, 60.0),
        ]
        assert file.lift.programme[-1].tension > 100e3
        assert any("splash-zone: its hold" in note for note in file.notes)

    @pytest.mark.parametrize(
        ("rows", "says"),
        [
            (
                '[[phase]]\nkind = "in-air"\n[[phase]]\nkind = "lift-off"\ndepth = "-8 m"\n[[phase]]\nname = "over"\nkind = "in-air"',
                "begins or ends on a ground",
            ),
            (
                '[[phase]]\nkind = "in-air"\n[[phase]]\nname = "a"\nkind = "in-air"\ntip = "x=1 m, y=2 m"\n[[phase]]\nname = "b"\nkind = "in-air"',
                "has its crane tip at another place",
            ),
            ('[[phase]]\nkind = "lift-off"', "no run can follow any"),
            ('[[phase]]\nkind = "in-air"\n[[phase]]\nname = "b"\nmode = "ahc"\ntime = "5 s"', "kind: missing"),
            ('[[phase]]\nmode = "ahc"\ntime = "5 s"\nhold = "30 kN"', "a tension to hold is tension"),
        ],
    )
    def test_what_no_run_can_follow_is_refused_in_one_line(self, rows, says, tmp_path):
        assert says in refused(load_lift, written(tmp_path, top("-5 m") + rows))

    def test_a_plan_without_a_sea_is_shown_one_of_its_cells(self, tmp_path):
        seas = (
            'vessel = "supply-vessel-82m"\n'
            + TOP
            + '[environment]\nHs = "1 m to 3 m by 1 m"\nTp = ["8 s"]\nheadings = ["170 deg"]\n'
        )
        line = refused(load_lift, written(tmp_path, f'start_depth = "-5 m"\n{seas}[[phase]]\nkind = "in-air"\n'))
        assert (
            'sea: missing, and a vessel is given. Write [sea] with wave = "jonswap Hs=1 m Tp=8 s" and heading = "170 deg"'
            in line
        )

    def test_an_old_form_is_a_note_on_standard_error(self, tmp_path, capsys):
        path = written(tmp_path, f'start = "3 m"\n{TOP}[[stage]]\nmode = "manual"\ntime = "2 s"\n')
        assert run(["payload", str(path)]) == 0
        err = capsys.readouterr().err
        assert (
            err
            == "note: lift.toml: an old form; stillhook convert lift.toml NEW.toml writes it in the words of today.\n"
        )
