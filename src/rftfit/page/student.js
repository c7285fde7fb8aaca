// Quantiles of Student's t and of the normal distribution, chances of chi squared.

const LANCZOS = [
  0.99999999999980993, 676.5203681218851, -1259.1392167224028, 771.32342877765313, -176.61502916214059,
  12.507343278686905, -0.13857109526572012, 9.9843695780195716e-6, 1.5056327351493116e-7,
];

function logGamma(x) {
  let sum = LANCZOS[0];
  for (let i = 1; i < 9; i += 1) sum += LANCZOS[i] / (x - 1 + i);
  const t = x + 6.5;
  return 0.5 * Math.log(TWO_PI) + (x - 0.5) * Math.log(t) - t + Math.log(sum);
}

/** Continued fraction of the incomplete beta function (modified Lentz). */
function betaFraction(a, b, x) {
  const tiny = 1e-300;
  const safe = (v) => (Math.abs(v) < tiny ? tiny : v);
  let c = 1;
  let d = 1 / safe(1 - ((a + b) * x) / (a + 1));
  let result = d;
  for (let m = 1; m < 1000; m += 1) {
    const even = (m * (b - m) * x) / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / safe(1 + even * d);
    c = safe(1 + even / c);
    result *= d * c;
    const odd = (-(a + m) * (a + b + m) * x) / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / safe(1 + odd * d);
    c = safe(1 + odd / c);
    const change = d * c;
    result *= change;
    if (Math.abs(change - 1) < 1e-16) break;
  }
  return result;
}

function incompleteBeta(a, b, x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const front = Math.exp(logGamma(a + b) - logGamma(a) - logGamma(b) + a * Math.log(x) + b * Math.log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return (front * betaFraction(a, b, x)) / a;
  return 1 - (front * betaFraction(b, a, 1 - x)) / b;
}

/** Regularised upper incomplete gamma function: the chance of a chi squared of 2 a degrees of freedom above 2 x. */
function upperGamma(a, x) {
  if (!(x > 0)) return 1;
  const front = Math.exp(a * Math.log(x) - x - logGamma(a));
  let term = 1 / a;
  let sum = term;
  if (x < a + 1) {
    for (let k = 1; term > 1e-17 * sum; k += 1) sum += term *= x / (a + k);
    return 1 - front * sum;
  }
  let fraction = 0;
  // the continued fraction, from far below
  for (let k = 200 + Math.round(8 * Math.sqrt(a)); k > 0; k -= 1) fraction = (k * (k - a)) / (x + 2 * k + 1 - a - fraction);
  return front / (x + 1 - a - fraction);
}

/** Half width of a two-sided interval in standard errors. */
function studentQuantile(confidence, dof) {
  // probability beyond +-t is I_x(dof / 2, 1 / 2) with x = dof / (dof + t^2)
  return quantileOf(confidence, (t) => incompleteBeta(dof / 2, 0.5, dof / (dof + t * t)));
}

function normalQuantile(confidence) {
  return quantileOf(confidence, (t) => upperGamma(0.5, (t * t) / 2));
}

/** Where the probability beyond +-t, which falls, is what an interval leaves out. */
function quantileOf(confidence, beyond) {
  let low = 0;
  let high = 1;
  while (beyond(high) > 1 - confidence && high < 1e12) high *= 2;
  for (let i = 0; i < 200 && high - low > 1e-15 * high; i += 1) {
    const middle = (low + high) / 2;
    if (beyond(middle) > 1 - confidence) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}
