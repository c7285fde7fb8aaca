// The scaling routine with its intervals: the same as rftfit.model.scaling.scale_new_medium.

/** Mean of numbers. */
function mean(values) {
  return values.reduce((sum, v) => sum + v, 0) / values.length;
}

/** Standard deviation of a sample. */
function deviation(values) {
  const centre = mean(values);
  return Math.sqrt(values.reduce((sum, v) => sum + (v - centre) ** 2, 0) / (values.length - 1));
}

/** zeta and chi of a new medium, each [value, lower, upper], from alpha_z straight down and its standard error, N/cm^3. */
function scaleNewMedium(alpha, se, reference) {
  // half widths add, so that more error of the test never narrows the interval
  const half = Math.hypot(reference.half_chi, (reference.half_test * se) / alpha);
  const around = (value, width) => [value, value * Math.exp(-width), value * Math.exp(width)];
  return { zeta: around(alpha / reference.chi, half), chi: around(reference.chi, reference.half_chi), student: reference.student };
}

/**
 * Value, lower and upper end of a quantity of the generic profile, scaled to one further medium; `measured`: whether the
 * media have it by measured alpha, then what nine terms miss on average counts too.
 */
function withInterval(scaled, generic, ofMedia, measured = false) {
  const scatter = deviation(ofMedia) * Math.sqrt(1 + 1 / ofMedia.length);
  const spread = measured ? Math.hypot(scatter, mean(ofMedia) - generic) : scatter;
  const shape = scaled.student * spread * scaled.zeta[0];
  const value = scaled.zeta[0] * generic;
  const ends = [scaled.zeta[1] * generic, scaled.zeta[2] * generic];
  return [
    value,
    value - Math.hypot(value - Math.min(...ends), shape),
    value + Math.hypot(Math.max(...ends) - value, shape),
  ];
}

/** The nine coefficients of a new medium, each [value, lower, upper]; `scaled`: as `scaleNewMedium` returns it. */
function scaledCoefficients(scaled, reference) {
  return reference.m0.map((m, i) => withInterval(scaled, m, reference.scaled.map((terms) => terms[i])));
}

/** Interval of a quantity from measured alpha of the reference media, from their nine terms where that has no number. */
function withMeasured(scaled, generic, fitted, measured) {
  const ofMedia = fitted.map((value, i) => (Number.isFinite(measured[i]) ? measured[i] : value));
  return withInterval(scaled, generic, ofMedia, measured.length > 0);
}

/** [alpha_z, alpha_x], each value, lower and upper end. */
function scaledAlpha(scaled, reference, beta, gamma) {
  const generic = fourierAlpha(reference.m0, beta, gamma);
  const fitted = reference.scaled.map((terms) => fourierAlpha(terms, beta, gamma));
  const measured = reference.tables.map((table) => alphaOf(table, beta, gamma));
  return [0, 1].map((c) => withMeasured(scaled, generic[c], fitted.map((pair) => pair[c]), measured.map((pair) => pair[c])));
}

/** Forces on a leg against theta, each a list of [value, lower, upper]. */
function scaledSweep(scaled, reference, leg, thetaDeg, rate) {
  const sweep = (profile) => sweepLeg(profile, leg, thetaDeg, rate);
  const unit = sweep({ kind: "fourier", values: reference.m0 });
  const fitted = reference.scaled.map((values) => sweep({ kind: "fourier", values }));
  const measured = reference.tables.map(sweep);
  const at = (curves, c, i) => curves.map((curve) => curve[c][i]);
  const of = (c) => thetaDeg.map((_, i) => withMeasured(scaled, unit[c][i], at(fitted, c, i), at(measured, c, i)));
  return { z: of("z"), x: of("x") };
}
