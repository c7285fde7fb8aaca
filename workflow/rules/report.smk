# Workbooks, figures and quality sheets. The png is what Snakemake watches; pdf and svg lie beside it.


rule workbooks:
    input:
        alpha=alpha_tables(PLAN.media),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    output:
        alpha_tables=report(
            "results/alpha_tables.xlsx",
            caption="../report/workbooks.rst",
            category=OVERVIEW,
            labels=shown("workbook", "alpha"),
        ),
        coefficient_tables=report(
            "results/coefficients.xlsx",
            caption="../report/workbooks.rst",
            category=OVERVIEW,
            labels=shown("workbook", "coefficients"),
        ),
    log:
        "results/logs/workbooks.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("workbooks"),
        settings=PLAN.settings("fit", "media"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit workbooks config={params.campaign:q} {params.alpha:q}"
        " coefficients={input.coefficients:q} penetration={input.penetration:q}"
        " alpha_tables={output.alpha_tables:q}"
        " coefficient_tables={output.coefficient_tables:q} 2> {log:q}"


rule quality:
    input:
        tared="results/tared/{medium}.parquet",
        windows="results/windows/{medium}.parquet",
        fits="results/fits/{medium}.csv",
    output:
        png=report(
            "results/quality/{medium}.png",
            caption="../report/quality.rst",
            category=MEASUREMENT,
            labels=shown("quality sheet", "every plate run", "{medium}"),
        ),
        others=multiext("results/quality/{medium}", ".pdf", ".svg"),
    log:
        "results/logs/quality/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("quality"),
        settings=PLAN.settings("intruders", "media"),
    shell:
        "python -m rftfit quality config={params.campaign:q} medium={wildcards.medium:q}"
        " tared={input.tared:q} windows={input.windows:q} fits={input.fits:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_tare:
    input:
        tared="results/tared/{medium}.parquet",
        tares="results/tares/{medium}.csv",
    output:
        png=report(
            "results/figures/tare_{medium}.png",
            caption="../report/tare.rst",
            category=MEASUREMENT,
            labels=shown("tare", "one tare and its valid range", "{medium}"),
        ),
        others=multiext("results/figures/tare_{medium}", ".pdf", ".svg"),
    log:
        "results/logs/figure_tare/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_tare"),
        settings=PLAN.settings("media"),
    shell:
        "python -m rftfit figure_tare config={params.campaign:q} medium={wildcards.medium:q}"
        " tared={input.tared:q} tares={input.tares:q} png={output.png:q} 2> {log:q}"


rule figure_protocol:
    input:
        traces="results/traces/{medium}.parquet",
        tared="results/tared/{medium}.parquet",
        windows="results/windows/{medium}.parquet",
        fits="results/fits/{medium}.csv",
        legs="results/legs/{medium}.csv",
    output:
        png=report(
            "results/figures/fig_s1_protocol_{medium}.png",
            caption="../report/fig_s1_protocol.rst",
            category=MEASUREMENT,
            labels=shown("after Fig. S1", "from force to slope", "{medium}"),
        ),
        others=multiext("results/figures/fig_s1_protocol_{medium}", ".pdf", ".svg"),
    log:
        "results/logs/figure_protocol/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_protocol"),
        settings=PLAN.settings("intruders", "fit", "media"),
    shell:
        "python -m rftfit figure_protocol config={params.campaign:q} medium={wildcards.medium:q}"
        " traces={input.traces:q} tared={input.tared:q} windows={input.windows:q} fits={input.fits:q}"
        " legs={input.legs:q} png={output.png:q} 2> {log:q}"


rule figure_clocks:
    input:
        # it takes the estimates again from the logs: the traces do not keep their details
        logs=lambda wildcards: PLAN.logs(wildcards.medium),
        traces="results/traces/{medium}.parquet",
    output:
        png=report(
            "results/figures/clocks_{medium}.png",
            caption="../report/clocks.rst",
            category=MEASUREMENT,
            labels=shown("clocks", "how the two clocks were brought together"),
        ),
        others=multiext("results/figures/clocks_{medium}", ".pdf", ".svg"),
    log:
        "results/logs/figure_clocks/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_clocks"),
        rows=lambda wildcards: PLAN.rows(wildcards.medium),
        settings=PLAN.settings(),
    shell:
        "python -m rftfit figure_clocks config={params.campaign:q} medium={wildcards.medium:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_linearity:
    input:
        tared=expand("results/tared/{medium}.parquet", medium=PLAN.laboratory),
        windows=expand("results/windows/{medium}.parquet", medium=PLAN.laboratory),
        fits=expand("results/fits/{medium}.csv", medium=PLAN.laboratory),
        alpha=alpha_tables(PLAN.laboratory),
    output:
        png=report(
            "results/figures/fig_s2_linearity.png",
            caption="../report/fig_s2_linearity.rst",
            category=MEASUREMENT,
            labels=shown("after Fig. S2", "stress against depth, all media"),
        ),
        others=multiext("results/figures/fig_s2_linearity", ".pdf", ".svg"),
    log:
        "results/logs/figure_linearity.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_linearity"),
        settings=PLAN.settings("intruders", "fit", "media"),
        tared=named("tared"),
        windows=named("windows"),
        fits=named("fits"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit figure_linearity config={params.campaign:q} {params.tared:q}"
        " {params.windows:q} {params.fits:q} {params.alpha:q} png={output.png:q} 2> {log:q}"


rule figure_stress:
    input:
        tared=expand("results/tared/{medium}.parquet", medium=PLAN.stress_media),
        windows=expand("results/windows/{medium}.parquet", medium=PLAN.stress_media),
        fits=expand("results/fits/{medium}.csv", medium=PLAN.stress_media),
    output:
        png=report(
            "results/figures/fig_2b_stress.png",
            caption="../report/fig_2b_stress.rst",
            category=MEASUREMENT,
            labels=shown("Fig. 2B", "stress against depth"),
        ),
        others=multiext("results/figures/fig_2b_stress", ".pdf", ".svg"),
    log:
        "results/logs/figure_stress.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_stress"),
        settings=PLAN.settings("intruders", "fit", "figures", "media"),
        tared=named("tared"),
        windows=named("windows"),
        fits=named("fits"),
    shell:
        "python -m rftfit figure_stress config={params.campaign:q} {params.tared:q} {params.windows:q}"
        " {params.fits:q} png={output.png:q} 2> {log:q}"


rule figure_maps_of_one:
    input:
        alpha="results/alpha/{medium}.csv",
    output:
        png=report(
            "results/figures/fig_2cd_maps_{medium}.png",
            caption="../report/maps.rst",
            category=PROFILES,
            labels=shown("Fig. 2C-D", "measured alpha", "{medium}"),
        ),
        others=multiext("results/figures/fig_2cd_maps_{medium}", ".pdf", ".svg"),
    log:
        "results/logs/figure_maps/{medium}.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_maps"),
        settings=PLAN.settings("fit", "media"),
    shell:
        "python -m rftfit figure_maps config={params.campaign:q} alpha={input.alpha:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_maps:
    input:
        alpha=alpha_tables(PLAN.laboratory),
    output:
        png=report(
            "results/figures/fig_s4_maps.png",
            caption="../report/maps.rst",
            category=PROFILES,
            labels=shown("Fig. S4", "measured alpha"),
        ),
        others=multiext("results/figures/fig_s4_maps", ".pdf", ".svg"),
    log:
        "results/logs/figure_maps.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_maps"),
        settings=PLAN.settings("fit", "media"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit figure_maps config={params.campaign:q} {params.alpha:q}"
        " png={output.png:q} 2> {log:q}"


rule figure_fit:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        coefficients="results/coefficients.csv",
    output:
        png=report(
            "results/figures/fig_s6_fit.png",
            caption="../report/fig_s6_fit.rst",
            category=PROFILES,
            labels=shown("Fig. S6", "nine-term fits"),
        ),
        others=multiext("results/figures/fig_s6_fit", ".pdf", ".svg"),
    log:
        "results/logs/figure_fit.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_fit"),
        settings=PLAN.settings("fourier", "media"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit figure_fit config={params.campaign:q} {params.alpha:q}"
        " coefficients={input.coefficients:q} png={output.png:q} 2> {log:q}"


rule figure_generic:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    output:
        png=report(
            "results/figures/fig_s7_generic.png",
            caption="../report/fig_s7_generic.rst",
            category=PROFILES,
            labels=shown("Fig. S7", "generic profile"),
        ),
        others=multiext("results/figures/fig_s7_generic", ".pdf", ".svg"),
    log:
        "results/logs/figure_generic.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_generic"),
        settings=PLAN.settings("fourier", "media"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit figure_generic config={params.campaign:q} {params.alpha:q}"
        " coefficients={input.coefficients:q} penetration={input.penetration:q}"
        " png={output.png:q} 2> {log:q}"
