// The session of the first part: ten channels and a finger, with the parameters of the sliders.

export interface Parameters {
  rate_hz: number;
  phase_us: number;
  // Torque of the muscles, share of the nominal wearer's.
  strength: number;
  delay_ms: number;
}

const MUSCLE =
  "a_n_per_s = 121.9, k = 0.300, tau_c_ms = 20.8, tau1_ms = 33.1, tau2_ms = 194.4, slope_per_unit = ";

// Channels 1 to 3: points of participant P (Hamana 2022, table 7), voltage stages.
const POINTS = [
  { name: "flexor A", limit: 28, threshold: 20 },
  { name: "flexor B", limit: 36, threshold: 25 },
  { name: "extensor", limit: 26, threshold: 14 },
];

export const FREE_CHANNELS = [4, 5, 6, 7, 8, 9, 10];

// Text of the session. Offsets of the channels spread over the period, B follows A by the phase.
export function sceneText(p: Parameters): string {
  const period_us = Math.round(1e6 / p.rate_hz);
  const fixed = (value: number, digits: number): string => value.toFixed(digits);
  const points = POINTS.map((point, i) => {
    const offset = [0, p.phase_us, Math.round(period_us / 2)][i];
    return `[[channel]]
number = ${i + 1}
name = "${point.name}"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = ${fixed(point.limit, 1)}
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, period_us = ${period_us}, offset_us = ${offset} }
muscle = { model = "calcium-force", ${MUSCLE}0.2, motor_threshold = ${fixed(point.threshold, 1)}, reference = ${fixed(point.limit, 1)} }
`;
  });
  const free = FREE_CHANNELS.map((number, i) => {
    const offset = Math.round((period_us * (i + 1)) / (FREE_CHANNELS.length + 2));
    return `[[channel]]
number = ${number}
name = "muscle ${number}"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 12.0
train = { shape = "biphasic-cathodic-first", width_us = 200, gap_us = 50, period_us = ${period_us}, offset_us = ${offset} }
muscle = { model = "calcium-force", ${MUSCLE}0.46, motor_threshold = 8.0, reference = 12.0 }
`;
  });
  return `title = "Ten channels and a finger"
duration_s = 3600.0

[wearer]
max_current_ma = 20.0
max_charge_uc = 5.0
max_rms_ma = 10.0
rise_ms = 200
fall_ms = 50
host_timeout_ms = 100

${points.join("\n")}
${free.join("\n")}
[[group]]
channels = [1, 2]
partner = "conducted"

[joint]
law = "recommended"
flexors = [{ channel = 1, threshold = 20.0, max = 28.0 }, { channel = 2, threshold = 25.0, max = 36.0 }]
extensor = { channel = 3, threshold = 14.0, max = 26.0 }
hold = "extrapolate"
sensor = "adc"

[joint.wearer]
rest_deg = 5.0
stiffness_nm_per_rad = 0.12
damping_nm_s_per_rad = 0.018
flexion_nm = 0.484
extension_nm = 0.15
torque_loss = 0.25

[joint.response]

[setpoints]
kind = "angle-sine"
rate_hz = 90
offset_deg = 45.0
amplitude_deg = 40.0
frequency_hz = 0.2

[body]
kind = "finger"
participant = "P"
flexor_a = 1
flexor_b = 2
extensor = 3
flexor_nm = ${fixed(0.22 * p.strength, 4)}
extensor_nm = ${fixed(0.15 * p.strength, 4)}
second_point_nm = ${fixed(0.264 * p.strength, 4)}
delay_ms = ${Math.round(p.delay_ms)}
`;
}
