# Workbooks, figures and quality sheets. The png is what Snakemake watches; pdf and svg lie beside it.


rule workbooks:
    input:
        alpha=alpha_tables(PLAN.media),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    output:
        alpha_tables="results/alpha_tables.xlsx",
        coefficient_tables="results/coefficients.xlsx",
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
        png="results/quality/{medium}.png",
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
        png="results/figures/tare_{medium}.png",
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


rule figure_stress:
    input:
        tared=expand("results/tared/{medium}.parquet", medium=PLAN.stress_media),
        windows=expand("results/windows/{medium}.parquet", medium=PLAN.stress_media),
        fits=expand("results/fits/{medium}.csv", medium=PLAN.stress_media),
    output:
        png="results/figures/fig_2b_stress.png",
        others=multiext("results/figures/fig_2b_stress", ".pdf", ".svg"),
    log:
        "results/logs/figure_stress.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("figure_stress"),
        settings=PLAN.settings("intruders", "fit", "figures"),
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
        png="results/figures/fig_2cd_maps_{medium}.png",
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
        png="results/figures/fig_s4_maps.png",
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
        png="results/figures/fig_s6_fit.png",
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
        png="results/figures/fig_s7_generic.png",
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
