//! Data processing: results and flags.

use super::Machine;
use super::data_table::CASES;

/// Letters of `text` that are in upper case, as APSR bits.
fn flags(text: &str) -> u32 {
    text.chars()
        .map(|letter| match letter {
            'N' => 1 << 31,
            'Z' => 1 << 30,
            'C' => 1 << 29,
            'V' => 1 << 28,
            'Q' => 1 << 27,
            _ => 0,
        })
        .sum()
}

#[test]
fn results_and_flags_are_the_manuals() {
    for (name, code, flags_before, before, after, flags_after) in CASES {
        let mut machine = Machine::new(code).with(before);
        machine.cpu.registers.apsr = flags(flags_before);
        let mut expected = machine.cpu.registers.r;
        for (n, value) in *after {
            expected[*n] = *value;
        }
        expected[15] = super::CODE + 2 * code.len() as u32;
        machine.steps(1);
        assert_eq!(machine.cpu.registers.r, expected, "{name}");
        assert_eq!(machine.cpu.registers.apsr, flags(flags_after), "{name}");
    }
}
