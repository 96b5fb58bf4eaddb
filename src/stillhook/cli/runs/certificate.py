"""`stillhook certificate`: its summary and check, signing it, and the keys for that."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Json, present, refuse
from stillhook.errors import TrustError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import Answer, Line, answer_of, print_document, progress_bar
from stillhook.units import number, quote

if TYPE_CHECKING:
    from datetime import date

    from stillhook.trust.keys import SigningKey
    from stillhook.trust.trust_list import TrustedKey
    from stillhook.validate.certificate.recheck import Check

KEY_HELP = "Private key; by default the user's own, which stillhook certificate key new made."


def certificate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="certificate.json that stillhook validate wrote.")],
    check: Annotated[bool, typer.Option("--check", help="Verify it, recomputing everything from the logs.")] = False,
    campaign: Annotated[
        Path | None, typer.Option(help="With --check: campaign file, if it is not next to the certificate.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="With --check: compare hashes only.")] = False,
    json: Json = False,
) -> None:
    """Summary of a certificate and who signed it; with --check whether it is valid: signed by a trusted key, the same
    logs, campaign, criteria, crane and code, and the same results when everything is recomputed from the logs.

    "stillhook certificate sign FILE" signs one; "stillhook certificate key new", "show" and "trust" are about keys.

    Exit code 1 where the validation was not passed; with --check where it is not valid or inputs are missing. 2 if the
    file is not a certificate or was changed.

    Example: stillhook certificate validation/certificate.json

    Example: stillhook certificate validation/certificate.json --check
    """
    from stillhook.trust.trust_list import users_trust
    from stillhook.validate.certificate.certificate import load_certificate

    if check:
        raise typer.Exit(0 if _checked(file, campaign, quick=quick, json=json) else 1)
    refuse({"--campaign": campaign, "--quick": quick}, "belongs to --check. Give it, or leave this out.")
    read = load_certificate(file)
    step, document = f"stillhook certificate {argument(file)} --check", read.summary()
    brief = lambda: answer_of(document, step, "every criterion, signature")
    data = {**read.data, "standing": read.judged(users_trust()).to_dict()}
    present(data, brief=brief, json=json, show=lambda: print_document(document))
    raise typer.Exit(0 if read.passed else 1)


def _checked(file: Path, campaign: Path | None, *, quick: bool, json: bool) -> bool:
    """Print whether a certificate still holds, and return it."""
    from stillhook.validate.certificate.certificate import load_certificate
    from stillhook.validate.certificate.recheck import check

    read = load_certificate(file)
    with progress_bar("checking") as bar:
        result = check(file, read, campaign=campaign, quick=quick, progress=bar)
    present(result.to_dict(), brief=lambda: _answer_of_check(file, result), json=json)
    return bool(result.holds)


def _answer_of_check(file: Path, result: Check) -> Answer:
    """Whether it holds, and the first of what changed, is missing or differs."""
    lines: list[Line] = [result.verdict]
    if result.computed:
        same = "identical to the byte" if result.same_bytes else "not identical to the byte; no number differs"
        if result.where and not result.same_bytes:
            most = number(100.0 * result.largest, 2)
            same = f"not identical to the byte; numbers differ by up to {most} % ({result.where})"
        lines.append(f"Recomputed from the logs: {same}.")
    if result.certificate.data["synthetic"]:
        lines.append("SYNTHETIC: a certificate of simulated logs, not of a real crane")
    found = {"changed": result.changed, "missing": result.missing, "otherwise": result.lines}
    lines += [f"{title}: {line}" for title, of in found.items() for line in of]
    if result.computed and result.same_pdf is not None and result.same_bytes:
        same = "the same to the byte" if result.same_pdf else "not the same: edited, or set with other libraries"
        lines.append(partial(wrapped, f"PDF in the same folder: {same}"))
    how, step = result.judgement.lines
    lines += [partial(wrapped, how) if result.judgement.trusted else how, partial(wrapped, step)]
    return Answer(f"{file}", lines, more="signature, PDF")


def sign(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="certificate.json, the state of a condition; or of a folder or an FMU its manifest."
        ),
    ],
    key: Annotated[Path | None, typer.Option(help=KEY_HELP)] = None,
    json: Json = False,
) -> None:
    """Sign a certificate with a private key, in place of any signature before; its PDF is set again and names the
    signer. Signed twice it has the same bytes. "stillhook validate --out" signs where the user has a key.

    Of a folder of results, an FMU or a system of FMUs the manifest is signed, if every part of it is as it was written;
    of a crane that is followed (stillhook condition) its state.

    Example: stillhook certificate sign validation/certificate.json

    Example: stillhook certificate sign results
    """
    from stillhook.library.condition import is_state, sign_state
    from stillhook.trust.comparison import has_manifest
    from stillhook.trust.trust_list import users_trust
    from stillhook.validate.certificate.certificate import sign_certificate

    if has_manifest(file):
        _sign_parts(file, signing_key(key), json=json)
        return
    if is_state(file):
        made_state = sign_state(file, signing_key(key))
        judgement = made_state.judged(users_trust())
        line = f"Signature: {judgement.sentence}."
        state = {"state": made_state.digest, "signature": judgement.to_dict()}
        present(state, brief=lambda: Answer(f"{file}: state of {made_state.crane}", [line]), json=json)
        return
    made = sign_certificate(file, signing_key(key))
    judgement = made.judged(users_trust())
    step = f"stillhook certificate {argument(file)} --check"
    if not judgement.trusted:
        step = "stillhook certificate key trust PUBLIC.pem, on every machine that shall credit it"
    envelope = made.short.envelope
    ranges = "" if envelope is None else ", ".join(f"{name} {text}" for name, text in envelope.says().items())
    mark = "SYNTHETIC: " if made.short.synthetic else ""
    lines = [f"{mark}{made.data['verdict']}", *([f"validated for: {ranges}"] if ranges else []), judgement.lines[0]]
    answer = Answer(f"{file}: certificate {made.short.short}", lines, step)
    data = {"certificate": made.digest, "signature": judgement.to_dict()}
    present(data, brief=lambda: answer, json=json)


def _sign_parts(place: Path, key: SigningKey, *, json: bool) -> None:
    """Sign the manifest of a folder or an FMU, and say so."""
    from stillhook.trust.comparison import sign_parts
    from stillhook.trust.trust_list import users_trust

    made = sign_parts(place, key)
    judgement = made.judged(users_trust())
    lines: list[Line] = [f"Signature: {judgement.sentence}."]
    answer = Answer(f"{place}: manifest of {len(made.parts)} parts", lines, f"stillhook manifest {argument(place)}")
    present({"manifest": made.digest, "signature": judgement.to_dict()}, brief=lambda: answer, json=json)


def key_new(
    name: Annotated[str, typer.Option(help="Name that the key signs by: of a department or a person.")],
    out: Annotated[Path | None, typer.Option(help="Folder for it, in place of the user's folder of settings.")] = None,
    json: Json = False,
) -> None:
    """Make a key that signs certificates: key.pem, which stays with its owner, and public.pem to hand out. A
    passphrase is asked for, or taken from STILLHOOK_PASSPHRASE; an empty one leaves key.pem unencrypted.

    Example: stillhook certificate key new --name "Sea trials department"
    """
    from stillhook.trust import home
    from stillhook.trust.keys import new_key, write_key

    folder, made = home.home() if out is None else out, new_key(name)
    private, public = folder / home.KEY, folder / home.PUBLIC
    for path in (private, public):
        if path.exists():
            raise TrustError(f"{path}: exists, and would be lost. Choose another folder with --out.")
    word = _passphrase(f"Passphrase for {private} (empty: none): ", twice=True)
    write_key(made, private, public, word)
    lines: list[Line] = [
        f"Key id {made.public.id}",
        f"private: {private} ({'encrypted' if word else 'not encrypted'}); never hand it out",
        f"public: {public}, to hand out; tell its id by another way than the file",
    ]
    data = {"name": made.name, "key": made.public.id, "private": str(private), "public": str(public)}
    answer = Answer(f"New key of {made.name}", lines, f"stillhook certificate key trust {argument(public)}")
    present(data | {"encrypted": bool(word)}, brief=lambda: answer, json=json)


def key_show(
    public: Annotated[
        Path | None, typer.Argument(metavar="[PUBLIC.pem]", help="A public key; by default the user's own.")
    ] = None,
    json: Json = False,
) -> None:
    """Print a public key's name and id, and the keys that the user trusts with their days.

    Example: stillhook certificate key show
    """
    from stillhook.trust import home
    from stillhook.trust.keys import read_public
    from stillhook.trust.trust_list import users_trust

    trust, file = users_trust(), home.home() / home.PUBLIC if public is None else public
    shown = read_public(file) if public is not None or file.exists() else None
    title = "No key of your own" if shown is None else f"{shown.name or 'Key without a name'}: key id {shown.id}"
    listed = [_row(key) for key in trust.keys]
    lines: list[Line] = [f"{len(listed)} trusted keys in {trust.file}", *listed]
    step = (
        'stillhook certificate key new --name "NAME"'
        if shown is None
        else f"stillhook certificate key trust {argument(file)}"
    )
    data = {
        "name": None if shown is None else shown.name or None,
        "key": None if shown is None else shown.id,
        "file": str(trust.file),
        "trusted": [_facts(key) for key in trust.keys],
    }
    present(data, brief=lambda: Answer(title, lines, step), json=json)


def key_trust(
    public: Annotated[Path, typer.Argument(metavar="PUBLIC.pem", help="Public key to trust, or to revoke.")],
    name: Annotated[str | None, typer.Option(help="What its owner is called; by default as the file says.")] = None,
    since: Annotated[str | None, typer.Option("--from", help="First day, such as 2026-01-01.")] = None,
    until: Annotated[str | None, typer.Option(help="Last day, such as 2027-12-31.")] = None,
    revoke: Annotated[str | None, typer.Option(help="Trust it no longer, for this reason.")] = None,
    json: Json = False,
) -> None:
    """Trust a public key: certificates that it signed are credited from now on, here and by this user. What was said
    of the same key before is replaced; a revoked key stays revoked.

    Example: stillhook certificate key trust public.pem --until 2027-12-31

    Example: stillhook certificate key trust public.pem --revoke "laptop stolen"
    """
    from stillhook.trust.keys import read_public
    from stillhook.trust.trust_list import TrustedKey, users_trust

    key, trust = read_public(public), users_trust()
    before, days = trust.entry(key), (_day("--from", since), _day("--until", until))
    if before is not None and before.revoked is not None:
        raise TrustError(
            f"{public.name}: this key was revoked on {before.revoked}. Its owner makes a new one; where that was a"
            f" mistake, remove the entry from {trust.file}."
        )
    called = name or (key.name if before is None else before.name)
    if not called:
        raise TrustError(f'{public.name}: no name in it. Give one: --name "NAME".')
    if revoke is None:
        entry = TrustedKey.of(called, key, *days)
    else:
        refuse({"--from": since, "--until": until}, "has no meaning for a revoked key. Leave it out.")
        old = TrustedKey.of(called, key) if before is None else before
        entry = old.revoking(trust.clock(), revoke)
    trust.trusting(entry).write()
    lines: list[Line] = [_row(entry), f"written to {trust.file}"]
    step = "compare the id with what its owner tells you, by another way than the file" if revoke is None else ""
    present(_facts(entry) | {"file": str(trust.file)}, brief=lambda: Answer(f"{called}", lines, step), json=json)


def signing_key(file: Path | None) -> SigningKey:
    """The private key of a file, or the user's own. Errors: TrustError, one line, where there is none."""
    from stillhook.trust import home
    from stillhook.trust.keys import read_key

    path = home.home() / home.KEY if file is None else file
    return read_key(path, lambda: _passphrase(f"Passphrase of {path}: "))


def users_key() -> SigningKey | None:
    """The user's own key, None where he has none. Errors: TrustError, one line, where it cannot be used."""
    from stillhook.trust import home

    return signing_key(None) if (home.home() / home.KEY).exists() else None


def _passphrase(prompt: str, *, twice: bool = False) -> str:
    """The passphrase of STILLHOOK_PASSPHRASE, else as typed; empty without a terminal. Errors: TrustError where two
    entries differ."""
    import getpass
    import sys

    from stillhook.trust.keys import PASSPHRASE

    word = os.environ.get(PASSPHRASE)
    if word is not None or not sys.stdin.isatty():
        return word or ""
    typed = getpass.getpass(prompt)
    if twice and typed and getpass.getpass("The same again: ") != typed:
        raise TrustError("Passphrase: the two entries differ. Begin again.")
    return typed


def _day(option: str, text: str | None) -> date | None:
    from datetime import date

    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise TrustError(f"{option} {quote(text)}: give a day, such as 2027-12-31.") from None


def _row(key: TrustedKey) -> str:
    return f"{key.name}: key id {key.public.id}, {key.days}"


def _facts(key: TrustedKey) -> dict[str, object]:
    from stillhook.trust.trust_list import DAYS

    days = {name: None if (day := getattr(key, name)) is None else day.isoformat() for name in DAYS}
    return {"name": key.name, "key": key.public.id, **days, "reason": key.reason or None}
