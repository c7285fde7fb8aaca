"""Does the interval of each level contain the truth in campaigns that are written and read as files."""

from dataclasses import replace

from coverage_levels import medium_inside, peaks_inside, quarters_inside, stress_inside, true_curve
from paper import enact, paper_values

from rftfit.compare.legs import extreme, measured_peak
from rftfit.model.scaling import fit_terms
from rftfit.reference import LEGS, MEDIA, load
from rftfit.results import Results
from rftfit.workflow import measure

MEASURED = [name for _, names in measure.MEASURED for name in names]


def written(folder, sizes, number, seed, draws):
    """Write the logs of the plates and legs of one medium; the path of the config.

    `number`: Of the campaign; media take turns.
    """
    medium = MEDIA[number % len(MEDIA)]
    values = paper_values("robot", "errors")
    values["media"] = {medium: values["media"][medium]}
    values["fourier"] = {**values.get("fourier", {}), "draws": draws}
    return enact(folder, values, sizes, seed=seed + number)


def measured(campaign, slow_noise_N=0.0):
    """Measure the logs of a campaign of one medium, all stages up to the slopes."""
    transducer = campaign.config.transducer.model_copy(update={"slow_noise_N": slow_noise_N})
    config = campaign.config.model_copy(update={"transducer": transducer})
    results = Results(replace(campaign, config=config))
    (medium,) = results.media
    measure.measure_logs(results, medium)
    return results


def held_in_files(results, stated_errors, sizes, number):
    """Intervals of a measured campaign by level, of which so much is stated."""
    (medium,) = results.media
    config = results.config.model_copy(update={"errors": stated_errors})
    stated = Results(replace(results.campaign, config=config))
    for name in MEASURED:
        stated.hold(name.format(medium), results.table(name.format(medium)))
    verdicts, alpha, *_ = measure.checks(stated, medium)
    stated.hold(f"checks/{medium}.csv", verdicts)
    intervals = quarters_inside(alpha)
    if "power" in sizes:
        intervals |= stress_inside(alpha, sizes["power"])
    intervals |= medium_inside(fit_terms(alpha, config, "lsq"))
    leg = LEGS[number // len(MEDIA) % len(LEGS)]
    curves, _ = measure.legs(stated, medium)
    true = true_curve(medium, leg, config)
    z, x = (_true_error(medium, leg, c, true[c]) for c in "zx")
    return intervals | peaks_inside(alpha, leg, config, curves, true, (z, x))


def _true_error(medium, leg, component, predicted):
    """Error of the peak that the true table gives, against the published curve, percent."""
    table = load("fig_s5")
    rows = table[(table["medium"] == medium) & (table["leg"] == leg)].sort_values("theta_deg")
    theta, force = (rows[name].to_numpy(float) for name in ("theta_deg", f"force_{component}_N"))
    peak = measured_peak(theta, force, component).force_N
    return 100 * (float(predicted[extreme(predicted, component)]) / peak - 1)
