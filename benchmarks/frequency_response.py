"""A year of measured spectra by the frequency-domain method.

`python -m benchmarks.frequency_response SPECTRA VESSEL [--json]`

SPECTRA is an NDBC spectral file, VESSEL a file of motion transfer functions. Everything that a user waits for is timed
from the start of the process: imports, reading, the residual of the winch (recomputed, or from the disk cache), the
frequency response.
"""

import argparse
import json
import math
from time import perf_counter, process_time
from typing import Any

START = perf_counter()
CRANE, PAYLOAD, DEPTH = "deep-250t", "manifold-60t", 1500.0
X, Y, HEADING = -20.0, -18.0, math.pi


def year(
    spectra: str, vessel: str, payload: str = PAYLOAD, depth: float = DEPTH, cache: bool = True
) -> tuple[Any, dict[str, float]]:
    """The Dataset of a year, and wall times of its parts [s]."""
    from stillhook import load_crane
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.formats.waves.buoys import read_spectra
    from stillhook.library.catalogue import read_payload
    from stillhook.response.forcing import forcing_of_series
    from stillhook.response.frequency_domain import frequency_response
    from stillhook.response.suspended_load import suspended_load
    from stillhook.response.winch.identify import identify_residual
    from stillhook.spec.lift.lowering import Lowering
    from stillhook.spec.lift.phase import Phase

    marks = {"imports": perf_counter() - START}
    last = perf_counter()

    def done(name: str) -> None:
        nonlocal last
        marks[name] = perf_counter() - last
        last = perf_counter()

    series, rao = read_spectra(spectra), read_vessel(vessel)
    done("reading")
    crane, programme = load_crane(CRANE), (Phase(mode="ahc", time="60 s"),)
    lift = Lowering(
        payload=read_payload(payload),
        h_tip="25 m",
        depth="3000 m",
        start_depth="-5 m",
        programme=programme,
        duration="60 s",
    )
    load = suspended_load(crane, lift, -depth)
    done("crane and lift")
    residual = identify_residual(crane, load.duty, cache=cache)
    done("residual")
    forcing = forcing_of_series(series, rao, X, Y, HEADING)
    done("tip")
    result = frequency_response(forcing, load, residual)
    done("frequency response")
    return result, marks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spectra")
    parser.add_argument("vessel")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    result, first = year(args.spectra, args.vessel, cache=False)
    year(args.spectra, args.vessel)
    cpu = process_time()
    _, again = year(args.spectra, args.vessel)
    cpu = process_time() - cpu
    again.pop("imports")
    report = {
        "records": result.sizes["case"],
        "residual recomputed": first,
        "total, residual recomputed": sum(first.values()),
        "residual from disk": again,
        "total, residual from disk": first["imports"] + sum(again.values()),
        "processor, from disk": cpu,
        "sigma_v mean": float(result["sigma_v"].mean()),
        "sigma_load mean": float(result["sigma_load"].mean()),
    }
    print(
        json.dumps(report, indent=2) if args.json else "\n".join(f"{name}: {value}" for name, value in report.items())
    )


if __name__ == "__main__":
    main()
