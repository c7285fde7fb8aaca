# Rules from alpha to the force model, and the model on trial (src/rftfit/workflow/profiles.py, validate.py).
CHECKS = expand("results/checks/{medium}.csv", medium=MEDIA)
ALPHA = expand("results/alpha/{medium}.csv", medium=LABORATORY)
ALPHA_OF_ALL = expand("results/alpha/{medium}.csv", medium=[*LABORATORY, *SANDS])
FLAGS = expand("results/flags/{medium}.csv", medium=MEDIA)
LEGS = expand("results/legs/{medium}.csv", medium=MEDIA)
# legs from whose measured forces the maps are estimated, too, where the configuration says so
TEACHERS = LEGS if CAMPAIGN.config.maps.use_legs else []


use rule stage as symmetry with:
    # Extend alpha to all intrusion angles by symmetry.
    input:
        alpha=ALPHA,
        state=state_of("symmetry"),
    output:
        "results/alpha_extended.csv",
    log:
        "results/logs/symmetry.log",


use rule stage as fourier with:
    # Fit the nine Fourier terms.
    input:
        checks=CHECKS,
        alpha=ALPHA,
        state=state_of("fourier"),
    output:
        "results/fourier/media.csv",
    log:
        "results/logs/fourier.log",


use rule stage as scaling with:
    # Scale media onto one another: zeta, chi, generic M0.
    input:
        checks=CHECKS,
        alpha=ALPHA_OF_ALL,
        fourier="results/fourier/media.csv",
        flags=FLAGS,
        state=state_of("scaling"),
    output:
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    log:
        "results/logs/scaling.log",


use rule stage as legs_predicted with:
    # Estimate the maps, predict forces on legs, compare with the measured ones, and say what each leg teaches.
    input:
        checks=CHECKS,
        alpha=ALPHA_OF_ALL,
        legs=LEGS,
        flags=FLAGS,
        state=state_of("legs_predicted"),
    output:
        predicted="results/predicted.csv",
        errors="results/leg_errors.csv",
        contacts="results/contacts.csv",
        maps=expand("results/maps/{medium}.csv", medium=[*LABORATORY, *SANDS]),
    log:
        "results/logs/legs_predicted.log",
    # many figures wait for it
    priority: 2


use rule stage as natural_sands with:
    # Scale natural sands from one penetration test.
    input:
        checks=CHECKS,
        tables=expand(
            "results/{table}/{medium}.csv",
            table=["runs", "tares", "fits", "alpha", "legs"],
            medium=SANDS,
        ),
        tared=expand("results/tared/{medium}.parquet", medium=SANDS),
        penetration="results/penetration.csv",
        predicted="results/predicted.csv",
        state=state_of("natural_sands"),
    output:
        sands="results/sands.csv",
        correction="results/sand_correction.csv",
    log:
        "results/logs/natural_sands.log",


use rule stage as validate with:
    # Put the paper's numbers beside ours: the reproduction table.
    input:
        checks=CHECKS,
        alpha=ALPHA,
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
        legs=LEGS,
        leg_errors="results/leg_errors.csv",
        robot=(
            multiext("results/robot/", "errors.csv", "optimum.csv", "speed.csv")
            if ROBOT
            else []
        ),
        state=state_of("validate"),
    output:
        "results/reproduction.csv",
    log:
        "results/logs/validate.log",
