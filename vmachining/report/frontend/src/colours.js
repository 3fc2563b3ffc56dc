// Colours of loads: viridis (van der Walt and Smith 2015), rising in lightness, so that eyes that do not tell red from green read it.

const STOPS = [
  [68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142],
  [31, 158, 137], [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37],
];

export function viridis(share) {
  const x = Math.max(0, Math.min(1, share)) * (STOPS.length - 1);
  const k = Math.min(STOPS.length - 2, Math.floor(x)), f = x - k;
  return STOPS[k].map((value, i) => value + f * (STOPS[k + 1][i] - value));
}

// Deviations: blue where material is left, red where too much is taken, pale where neither is.
const POLES = [[178, 24, 43], [239, 138, 98], [247, 240, 235], [103, 169, 207], [33, 102, 172]];

export function diverging(share) {
  const x = Math.max(0, Math.min(1, share)) * (POLES.length - 1);
  const k = Math.min(POLES.length - 2, Math.floor(x)), f = x - k;
  return POLES[k].map((value, i) => value + f * (POLES[k + 1][i] - value));
}

export function deviationScale(reach) {
  return { low: -reach, high: reach, colour: diverging, share: (v) => (Number.isFinite(v) ? (Math.max(-reach, Math.min(reach, v)) + reach) / (2 * reach) : null) };
}

// Values to shares of the scale; what is not there is null.
export function scaleOf(values, logarithmic) {
  let low = Infinity, high = -Infinity;
  for (const v of values) {
    if (!Number.isFinite(v) || (logarithmic && v <= 0)) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (!(high > -Infinity)) return { low: 0, high: 1, colour: viridis, share: () => null };
  if (!logarithmic) low = Math.min(low, 0);
  if (logarithmic) low = Math.max(low, high * 1e-4);
  const share = (v) => {
    if (!Number.isFinite(v)) return null;
    if (high === low) return 0.5;
    if (!logarithmic) return (v - low) / (high - low);
    return v <= low ? 0 : Math.log(v / low) / Math.log(high / low);
  };
  return { low, high, share, colour: viridis };
}

export const RAW = [176, 186, 198];
export const MARK = [232, 89, 12];
export const PATHS = { feed: 0x2f6fed, rapid: 0xd98200, hit: 0xd92d20 };
