// The scaling routine with its intervals: the same as rftfit.model.scaling.scale_new_medium.

function mean(values) {
  return values.reduce((sum, v) => sum + v, 0) / values.length;
}

function deviation(values) {
  const centre = mean(values);
  return Math.sqrt(values.reduce((sum, v) => sum + (v - centre) ** 2, 0) / (values.length - 1));
}

/** zeta and chi of a new medium with their intervals. */
function scaleNewMedium(alpha, se, reference) {
  // half widths add, so that more error of the test never narrows the interval
  const half = Math.hypot(reference.half_chi, (reference.half_test * se) / alpha);
  const around = (value, width) => [value, value * Math.exp(-width), value * Math.exp(width)];
  return { zeta: around(alpha / reference.chi, half), chi: around(reference.chi, reference.half_chi), student: reference.student };
}

/** Value, lower and upper end of a quantity of the generic profile, scaled to one further medium. */
function withInterval(scaled, generic, ofMedia) {
  const shape = scaled.student * deviation(ofMedia) * Math.sqrt(1 + 1 / ofMedia.length) * scaled.zeta[0];
  const value = scaled.zeta[0] * generic;
  const ends = [scaled.zeta[1] * generic, scaled.zeta[2] * generic];
  return [
    value,
    value - Math.hypot(value - Math.min(...ends), shape),
    value + Math.hypot(Math.max(...ends) - value, shape),
  ];
}

function scaledCoefficients(scaled, reference) {
  return reference.m0.map((m, i) => withInterval(scaled, m, reference.scaled.map((own) => own[i])));
}

/** [alpha_z, alpha_x], each value, lower and upper end. */
function scaledAlpha(scaled, reference, beta, gamma) {
  const generic = fourierAlpha(reference.m0, beta, gamma);
  const each = reference.scaled.map((own) => fourierAlpha(own, beta, gamma));
  return [0, 1].map((c) => withInterval(scaled, generic[c], each.map((pair) => pair[c])));
}

/** Forces on a leg against theta, each a list of [value, lower, upper]. */
function scaledSweep(scaled, reference, leg, thetaDeg, rate) {
  const unit = sweepLeg({ kind: "fourier", values: reference.m0 }, leg, thetaDeg, rate);
  const each = reference.scaled.map((own) => sweepLeg({ kind: "fourier", values: own }, leg, thetaDeg, rate));
  const of = (c) => thetaDeg.map((_, i) => withInterval(scaled, unit[c][i], each.map((own) => own[c][i])));
  return { z: of("z"), x: of("x") };
}
