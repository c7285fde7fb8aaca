# The robot: marker tracks to speeds, the sweep on three profiles, figures. Twice: `robot` is the reduced
# sweep of every run, `robot_full` the paper's own of 51 curvatures, 26 frequencies, 3 starting phases.

ROBOT = "6 Robot"
ROBOT_PROFILES = ["table", "generic", "depth_only"]


# A cluster's profile deals the full sweep out to more than one batch (set-scatter); on one machine
# the sweep is one job, which works on every core anyway.
scattergather:
    sweep=1,


BATCHES = gather.sweep("{scatteritem}")
FULL_SHARES = BATCHES if len(BATCHES) > 1 else []


rule robot_measured:
    input:
        tracks=PLAN.robot_files,
    output:
        trials="results/robot/tracks.csv",
        measured="results/robot/measured.csv",
        ledger="results/ledger/robot.csv",
    log:
        "results/logs/robot_measured.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("robot_measured"),
        # the content of the tracks, whatever their dates say
        content=PLAN.content(PLAN.robot_files),
        settings=PLAN.settings("raw", "media", "robot"),
    shell:
        "python -m rftfit robot_measured config={params.campaign:q} trials={output.trials:q}"
        " measured={output.measured:q} ledger={output.ledger:q} 2> {log:q}"


rule robot_intervals:
    input:
        PLAN.robot_file,
        alpha=alpha_tables(PLAN.laboratory),
        measured="results/robot/measured.csv",
    output:
        intervals="results/robot/intervals.csv",
    log:
        "results/logs/robot_intervals.log",
    conda:
        "../envs/rftfit.yaml"
    # the stage itself works on every core
    threads: workflow.cores
    params:
        campaign=CONFIG,
        code=PLAN.code("robot_intervals"),
        settings=PLAN.settings("fit", "media", "fourier", "robot"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit robot_intervals config={params.campaign:q} {params.alpha:q}"
        " measured={input.measured:q} intervals={output.intervals:q} 2> {log:q}"


rule robot_motion:
    input:
        PLAN.robot_file,
        alpha=f"results/alpha/{PLAN.robot_medium}.csv",
        coefficients="results/coefficients.csv",
    output:
        motion="results/robot/motion.csv",
    log:
        "results/logs/robot_motion.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("robot_motion"),
        settings=PLAN.settings("fourier", "robot"),
    shell:
        "python -m rftfit robot_motion config={params.campaign:q} alpha={input.alpha:q}"
        " coefficients={input.coefficients:q} motion={output.motion:q} 2> {log:q}"


rule robot_frames:
    input:
        PLAN.robot_file,
        alpha=f"results/alpha/{PLAN.robot_medium}.csv",
        coefficients="results/coefficients.csv",
    output:
        frames="results/robot/frames.json",
    log:
        "results/logs/robot_frames.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("robot_frames"),
        settings=PLAN.settings("fourier", "robot"),
    shell:
        "python -m rftfit robot_frames config={params.campaign:q} alpha={input.alpha:q}"
        " coefficients={input.coefficients:q} frames={output.frames:q} 2> {log:q}"


rule figures_robot_motion:
    input:
        motion="results/robot/motion.csv",
    output:
        fig_4b=report(
            "results/figures/fig_4b_robot_motion.png",
            caption="../report/fig_4b_robot_motion.rst",
            category=ROBOT,
            labels=shown("Fig. 4B", "motion of the robot"),
        ),
        fig_s14=report(
            "results/figures/fig_s14_robot_forces.png",
            caption="../report/fig_s14_robot_forces.rst",
            category=ROBOT,
            labels=shown("Fig. S14", "forces on a tripod"),
        ),
        others=expand(
            "results/figures/{name}.{ending}",
            name=["fig_4b_robot_motion", "fig_s14_robot_forces"],
            ending=["pdf", "svg"],
        ),
    log:
        "results/logs/figures_robot_motion.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        code=PLAN.code("figures_robot_motion"),
    shell:
        "python -m rftfit figures_robot_motion motion={input.motion:q} fig_4b={output.fig_4b:q}"
        " fig_s14={output.fig_s14:q} 2> {log:q}"


for PROFILE in ROBOT_PROFILES:

    rule:
        name:
            f"robot_full_batch_{PROFILE}"
        input:
            PLAN.robot_file,
            alpha=f"results/alpha/{PLAN.robot_medium}.csv",
            coefficients="results/coefficients.csv",
            measured="results/robot/measured.csv",
        output:
            # the sweep's own table has these rows too
            runs=temp(f"results/robot_full/batches/{PROFILE}_{{scatteritem}}.csv"),
        log:
            f"results/logs/robot_full_batch_{PROFILE}/{{scatteritem}}.log",
        conda:
            "../envs/rftfit.yaml"
        threads: workflow.cores
        params:
            campaign=CONFIG,
            sweep="robot_full",
            profile=PROFILE,
            code=PLAN.code("robot_sweep"),
            settings=PLAN.settings("fourier", "robot"),
        shell:
            "python -m rftfit robot_sweep config={params.campaign:q} profile={params.profile}"
            " sweep={params.sweep} batch={wildcards.scatteritem} threads={threads}"
            " alpha={input.alpha:q} coefficients={input.coefficients:q}"
            " measured={input.measured:q} runs={output.runs:q} 2> {log:q}"


for SWEEP, SHARES in [("robot", []), ("robot_full", FULL_SHARES)]:
    for PROFILE in ROBOT_PROFILES:

        rule:
            name:
                f"{SWEEP}_sweep_{PROFILE}"
            input:
                PLAN.robot_file,
                alpha=f"results/alpha/{PLAN.robot_medium}.csv",
                coefficients="results/coefficients.csv",
                measured="results/robot/measured.csv",
                parts=expand(
                    "results/{sweep}/batches/{profile}_{share}.csv",
                    sweep=SWEEP,
                    profile=PROFILE,
                    share=SHARES,
                ),
            output:
                runs=f"results/{SWEEP}/runs_{PROFILE}.csv",
            log:
                f"results/logs/{SWEEP}_sweep_{PROFILE}.log",
            conda:
                "../envs/rftfit.yaml"
            # the stage itself works on every core, unless batches leave it nothing to do
            threads: 1 if SHARES else workflow.cores
            params:
                campaign=CONFIG,
                sweep=SWEEP,
                profile=PROFILE,
                code=PLAN.code("robot_sweep"),
                settings=PLAN.settings("fourier", "robot"),
                parts=named("parts"),
            shell:
                "python -m rftfit robot_sweep config={params.campaign:q} profile={params.profile}"
                " sweep={params.sweep} batch=1-of-1 threads={threads} alpha={input.alpha:q}"
                " coefficients={input.coefficients:q} measured={input.measured:q}"
                " {params.parts:q} runs={output.runs:q} 2> {log:q}"

    rule:
        name:
            f"{SWEEP}_tables"
        input:
            PLAN.robot_file,
            measured="results/robot/measured.csv",
            runs=expand(
                "results/{sweep}/runs_{profile}.csv",
                sweep=SWEEP,
                profile=ROBOT_PROFILES,
            ),
            intervals="results/robot/intervals.csv",
        output:
            speed=f"results/{SWEEP}/speed.csv",
            optimum=f"results/{SWEEP}/optimum.csv",
            errors=f"results/{SWEEP}/errors.csv",
        log:
            f"results/logs/{SWEEP}_tables.log",
        conda:
            "../envs/rftfit.yaml"
        params:
            campaign=CONFIG,
            code=PLAN.code("robot_tables"),
            settings=PLAN.settings("fit", "robot"),
            runs=named("runs"),
        shell:
            "python -m rftfit robot_tables config={params.campaign:q} measured={input.measured:q}"
            " {params.runs:q} intervals={input.intervals:q} speed={output.speed:q}"
            " optimum={output.optimum:q} errors={output.errors:q} 2> {log:q}"

    rule:
        name:
            f"figures_{SWEEP}"
        input:
            speed=f"results/{SWEEP}/speed.csv",
            errors=f"results/{SWEEP}/errors.csv",
            optimum=f"results/{SWEEP}/optimum.csv",
        output:
            fig_4c=robot_figure(
                SWEEP,
                report(
                    f"results/figures/fig_4c_{SWEEP}_speed.png",
                    caption="../report/fig_4c_robot_speed.rst",
                    category=ROBOT,
                    labels=shown("Fig. 4C", "speed against frequency"),
                ),
            ),
            fig_4d=robot_figure(
                SWEEP,
                report(
                    f"results/figures/fig_4d_{SWEEP}_curvature.png",
                    caption="../report/fig_4d_robot_curvature.rst",
                    category=ROBOT,
                    labels=shown("Fig. 4D", "fastest curvature"),
                ),
            ),
            fig_s13=robot_figure(
                SWEEP,
                report(
                    f"results/figures/fig_s13_{SWEEP}_profiles.png",
                    caption="../report/fig_s13_robot_profiles.rst",
                    category=ROBOT,
                    labels=shown("Fig. S13", "speed by every profile"),
                ),
            ),
            others=expand(
                "results/figures/{name}.{ending}",
                name=[
                    f"fig_4c_{SWEEP}_speed",
                    f"fig_4d_{SWEEP}_curvature",
                    f"fig_s13_{SWEEP}_profiles",
                ],
                ending=["pdf", "svg"],
            ),
        log:
            f"results/logs/figures_{SWEEP}.log",
        conda:
            "../envs/rftfit.yaml"
        params:
            code=PLAN.code("figures_robot_speed"),
        shell:
            "python -m rftfit figures_robot_speed speed={input.speed:q} errors={input.errors:q}"
            " optimum={input.optimum:q} fig_4c={output.fig_4c:q} fig_4d={output.fig_4d:q}"
            " fig_s13={output.fig_s13:q} 2> {log:q}"


# the paper's sweep, started by `rftfit sweep`
rule robot_full:
    input:
        rules.robot_full_tables.output,
        rules.figures_robot_full.output,
