# Figures of legs and natural sands.


rule figure_legs:
    input:
        predicted="results/predicted.csv",
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
    output:
        png=report(
            "results/figures/fig_3_legs_{medium}.png",
            caption="../report/fig_3_legs.rst",
            category=LEGS,
            labels=shown("Fig. 3D-F", "forces on legs", "{medium}"),
        ),
        others=multiext("results/figures/fig_3_legs_{medium}", ".pdf", ".svg"),
    log:
        "results/logs/figure_legs/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_legs"),
        settings=PLAN.settings("fit", "intruders", "media"),
        legs=named("legs"),
    shell:
        "python -m rftfit figure_legs config={params.campaign:q} medium={wildcards.medium:q} predicted={input.predicted:q} {params.legs:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_leg_media:
    input:
        predicted="results/predicted.csv",
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
    output:
        png=report(
            "results/figures/fig_s5_legs.png",
            caption="../report/fig_s5_legs.rst",
            category=LEGS,
            labels=shown("Fig. S5", "forces on legs"),
        ),
        others=multiext("results/figures/fig_s5_legs", ".pdf", ".svg"),
    log:
        "results/logs/figure_leg_media.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_leg_media"),
        settings=PLAN.settings("fit", "media"),
        legs=named("legs"),
    shell:
        "python -m rftfit figure_leg_media config={params.campaign:q} predicted={input.predicted:q} {params.legs:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_sand_legs:
    input:
        predicted="results/predicted.csv",
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
    output:
        png=report(
            "results/figures/fig_s12_sand_legs.png",
            caption="../report/fig_s12_sand_legs.rst",
            category=SANDS,
            labels=shown("Fig. S12", "forces on legs"),
        ),
        others=multiext("results/figures/fig_s12_sand_legs", ".pdf", ".svg"),
    log:
        "results/logs/figure_sand_legs.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_sand_legs"),
        settings=PLAN.settings("fit", "media"),
        legs=named("legs"),
    shell:
        "python -m rftfit figure_sand_legs config={params.campaign:q} predicted={input.predicted:q} {params.legs:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_penetration:
    input:
        tared=expand("results/tared/{medium}.parquet", medium=PLAN.sands),
        windows=expand("results/windows/{medium}.parquet", medium=PLAN.sands),
        sands="results/sands.csv",
    output:
        png=report(
            "results/figures/fig_s11_penetration.png",
            caption="../report/fig_s11_penetration.rst",
            category=SANDS,
            labels=shown("Fig. S11", "penetration"),
        ),
        others=multiext("results/figures/fig_s11_penetration", ".pdf", ".svg"),
    log:
        "results/logs/figure_penetration.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_penetration"),
        settings=PLAN.settings("fit", "intruders", "media"),
        tared=named("tared"),
        windows=named("windows"),
    shell:
        "python -m rftfit figure_penetration config={params.campaign:q} {params.tared:q} {params.windows:q} sands={input.sands:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_generic_forces:
    input:
        predicted="results/predicted.csv",
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
        penetration="results/penetration.csv",
    output:
        png=report(
            "results/figures/fig_s8_generic_forces.png",
            caption="../report/fig_s8_generic_forces.rst",
            category=LEGS,
            labels=shown("Fig. S8", "forces over zeta"),
        ),
        others=multiext("results/figures/fig_s8_generic_forces", ".pdf", ".svg"),
    log:
        "results/logs/figure_generic_forces.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_generic_forces"),
        settings=PLAN.settings("fit", "fourier", "media"),
        legs=named("legs"),
    shell:
        "python -m rftfit figure_generic_forces config={params.campaign:q} predicted={input.predicted:q} {params.legs:q} penetration={input.penetration:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_peak_errors:
    input:
        errors="results/leg_errors.csv",
    output:
        png=report(
            "results/figures/peak_errors.png",
            caption="../report/peak_errors.rst",
            category=LEGS,
            labels=shown("peak errors", "predicted over measured peaks"),
        ),
        others=multiext("results/figures/peak_errors", ".pdf", ".svg"),
    log:
        "results/logs/figure_peak_errors.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_peak_errors"),
        settings=PLAN.settings("fit", "media"),
    shell:
        "python -m rftfit figure_peak_errors config={params.campaign:q} errors={input.errors:q}"
        " png={output.png:q} 2> {log:q}"
