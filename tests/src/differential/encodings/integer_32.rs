//! 32-bit instructions that access no memory (Arm ARM A5.3).

use super::{Encoding, Unit, excluded, plain, unit, valid};

/// Returns whether the modified immediate is defined; a zero byte repeated twice or four times is
/// UNPREDICTABLE.
const fn is_modified(w: u32) -> bool {
    let spread = w >> 26 & 1 == 0 && w >> 14 & 1 == 0 && w >> 12 & 3 != 0;
    !spread || w & 0xFF != 0
}

/// Returns whether the word encodes SSAT or USAT; with an arithmetic shift of 0 it is SSAT16 or
/// USAT16.
const fn saturates_words(w: u32) -> bool {
    w >> 21 & 1 == 0 || w & 0x70C0 != 0
}

const fn low_bit(w: u32) -> u32 {
    (w >> 12 & 7) << 2 | w >> 6 & 3
}

const fn extracts(w: u32) -> bool {
    low_bit(w) + (w & 31) < 32
}

const fn inserts(w: u32) -> bool {
    w & 31 >= low_bit(w)
}

/// Returns whether the operand's register number is equal in both fields that must contain it.
const fn has_same_operands(w: u32) -> bool {
    w >> 16 & 15 == w & 15
}

/// Encodings, special cases before general ones.
#[rustfmt::skip]
pub(super) const ENCODINGS: &[Encoding] = &[
    // Modified immediates.
    valid("TST (imm)", "11110i000001nnnn 0iii1111iiiiiiii", is_modified),
    valid("TEQ (imm)", "11110i001001nnnn 0iii1111iiiiiiii", is_modified),
    valid("CMN (imm)", "11110i010001nnnn 0iii1111iiiiiiii", is_modified),
    valid("CMP (imm, T2)", "11110i011011nnnn 0iii1111iiiiiiii", is_modified),
    valid("MOV (imm, T2)", "11110i00010s1111 0iiiddddiiiiiiii", is_modified),
    valid("MVN (imm)", "11110i00011s1111 0iiiddddiiiiiiii", is_modified),
    valid("AND (imm)", "11110i00000snnnn 0iiiddddiiiiiiii", is_modified),
    valid("BIC (imm)", "11110i00001snnnn 0iiiddddiiiiiiii", is_modified),
    valid("ORR (imm)", "11110i00010snnnn 0iiiddddiiiiiiii", is_modified),
    valid("ORN (imm)", "11110i00011snnnn 0iiiddddiiiiiiii", is_modified),
    valid("EOR (imm)", "11110i00100snnnn 0iiiddddiiiiiiii", is_modified),
    unit("ADD (SP to SP, T3)", "11110i01000011010iii1101iiiiiiii", Unit::Adjust),
    unit("SUB (SP to SP, T2)", "11110i01101011010iii1101iiiiiiii", Unit::Adjust),
    valid("ADD (SP + imm, T3)", "11110i01000s1101 0iiiddddiiiiiiii", is_modified),
    valid("SUB (SP - imm, T2)", "11110i01101s1101 0iiiddddiiiiiiii", is_modified),
    valid("ADD (imm, T3)", "11110i01000snnnn 0iiiddddiiiiiiii", is_modified),
    valid("ADC (imm)", "11110i01010snnnn 0iiiddddiiiiiiii", is_modified),
    valid("SBC (imm)", "11110i01011snnnn 0iiiddddiiiiiiii", is_modified),
    valid("SUB (imm, T3)", "11110i01101snnnn 0iiiddddiiiiiiii", is_modified),
    valid("RSB (imm, T2)", "11110i01110snnnn 0iiiddddiiiiiiii", is_modified),
    // Plain immediates.
    plain("ADR (T3)", "11110i1000001111 0iiiddddiiiiiiii"),
    plain("ADR (T2)", "11110i1010101111 0iiiddddiiiiiiii"),
    unit("ADDW (SP to SP)", "11110i10000011010iii1101iiiiiiii", Unit::Adjust),
    unit("SUBW (SP to SP)", "11110i10101011010iii1101iiiiiiii", Unit::Adjust),
    plain("ADDW (SP)", "11110i1000001101 0iiiddddiiiiiiii"),
    plain("SUBW (SP)", "11110i1010101101 0iiiddddiiiiiiii"),
    plain("ADDW", "11110i100000nnnn 0iiiddddiiiiiiii"),
    plain("MOVW", "11110i100100iiii 0iiiddddiiiiiiii"),
    plain("SUBW", "11110i101010nnnn 0iiiddddiiiiiiii"),
    plain("MOVT", "11110i101100iiii 0iiiddddiiiiiiii"),
    plain("SSAT16", "111100110010nnnn 0000dddd0000iiii"),
    valid("SSAT", "1111001100s0nnnn 0iiiddddii0iiiii", saturates_words),
    valid("SBFX", "111100110100nnnn 0iiiddddii0iiiii", extracts),
    valid("BFC", "1111001101101111 0iiiddddii0iiiii", inserts),
    valid("BFI", "111100110110nnnn 0iiiddddii0iiiii", inserts),
    plain("USAT16", "111100111010nnnn 0000dddd0000iiii"),
    valid("USAT", "1111001110s0nnnn 0iiiddddii0iiiii", saturates_words),
    valid("UBFX", "111100111100nnnn 0iiiddddii0iiiii", extracts),
    // Shifted registers.
    plain("TST (reg, T2)", "111010100001nnnn 0iii1111iiiimmmm"),
    plain("TEQ (reg)", "111010101001nnnn 0iii1111iiiimmmm"),
    plain("CMN (reg, T2)", "111010110001nnnn 0iii1111iiiimmmm"),
    plain("CMP (reg, T3)", "111010111011nnnn 0iii1111iiiimmmm"),
    plain("MOV and shifts (imm)", "11101010010s1111 0iiiddddiiiimmmm"),
    plain("MVN (reg, T2)", "11101010011s1111 0iiiddddiiiimmmm"),
    plain("AND (reg, T2)", "11101010000snnnn 0iiiddddiiiimmmm"),
    plain("BIC (reg, T2)", "11101010001snnnn 0iiiddddiiiimmmm"),
    plain("ORR (reg, T2)", "11101010010snnnn 0iiiddddiiiimmmm"),
    plain("ORN (reg)", "11101010011snnnn 0iiiddddiiiimmmm"),
    plain("EOR (reg, T2)", "11101010100snnnn 0iiiddddiiiimmmm"),
    plain("PKHBT, PKHTB", "111010101100nnnn 0iiiddddiii0mmmm"),
    plain("ADD (SP + reg, T3)", "11101011000s1101 0iiiddddiiiimmmm"),
    plain("ADD (reg, T3)", "11101011000snnnn 0iiiddddiiiimmmm"),
    plain("ADC (reg, T2)", "11101011010snnnn 0iiiddddiiiimmmm"),
    plain("SBC (reg, T2)", "11101011011snnnn 0iiiddddiiiimmmm"),
    plain("SUB (SP - reg)", "11101011101s1101 0iiiddddiiiimmmm"),
    plain("SUB (reg, T2)", "11101011101snnnn 0iiiddddiiiimmmm"),
    plain("RSB (reg)", "11101011110snnnn 0iiiddddiiiimmmm"),
    // Shifts, extensions, parallel arithmetic.
    plain("LSL (reg, T2)", "11111010000snnnn 1111dddd0000mmmm"),
    plain("LSR (reg, T2)", "11111010001snnnn 1111dddd0000mmmm"),
    plain("ASR (reg, T2)", "11111010010snnnn 1111dddd0000mmmm"),
    plain("ROR (reg, T2)", "11111010011snnnn 1111dddd0000mmmm"),
    plain("SXTH (T2)", "1111101000001111 1111dddd10iimmmm"),
    plain("SXTAH", "111110100000nnnn 1111dddd10iimmmm"),
    plain("UXTH (T2)", "1111101000011111 1111dddd10iimmmm"),
    plain("UXTAH", "111110100001nnnn 1111dddd10iimmmm"),
    plain("SXTB16", "1111101000101111 1111dddd10iimmmm"),
    plain("SXTAB16", "111110100010nnnn 1111dddd10iimmmm"),
    plain("UXTB16", "1111101000111111 1111dddd10iimmmm"),
    plain("UXTAB16", "111110100011nnnn 1111dddd10iimmmm"),
    plain("SXTB (T2)", "1111101001001111 1111dddd10iimmmm"),
    plain("SXTAB", "111110100100nnnn 1111dddd10iimmmm"),
    plain("UXTB (T2)", "1111101001011111 1111dddd10iimmmm"),
    plain("UXTAB", "111110100101nnnn 1111dddd10iimmmm"),
    plain("SADD8", "111110101000nnnn 1111dddd0000mmmm"),
    plain("QADD8", "111110101000nnnn 1111dddd0001mmmm"),
    plain("SHADD8", "111110101000nnnn 1111dddd0010mmmm"),
    plain("UADD8", "111110101000nnnn 1111dddd0100mmmm"),
    plain("UQADD8", "111110101000nnnn 1111dddd0101mmmm"),
    plain("UHADD8", "111110101000nnnn 1111dddd0110mmmm"),
    plain("SADD16", "111110101001nnnn 1111dddd0000mmmm"),
    plain("QADD16", "111110101001nnnn 1111dddd0001mmmm"),
    plain("SHADD16", "111110101001nnnn 1111dddd0010mmmm"),
    plain("UADD16", "111110101001nnnn 1111dddd0100mmmm"),
    plain("UQADD16", "111110101001nnnn 1111dddd0101mmmm"),
    plain("UHADD16", "111110101001nnnn 1111dddd0110mmmm"),
    plain("SASX", "111110101010nnnn 1111dddd0000mmmm"),
    plain("QASX", "111110101010nnnn 1111dddd0001mmmm"),
    plain("SHASX", "111110101010nnnn 1111dddd0010mmmm"),
    plain("UASX", "111110101010nnnn 1111dddd0100mmmm"),
    plain("UQASX", "111110101010nnnn 1111dddd0101mmmm"),
    plain("UHASX", "111110101010nnnn 1111dddd0110mmmm"),
    plain("SSUB8", "111110101100nnnn 1111dddd0000mmmm"),
    plain("QSUB8", "111110101100nnnn 1111dddd0001mmmm"),
    plain("SHSUB8", "111110101100nnnn 1111dddd0010mmmm"),
    plain("USUB8", "111110101100nnnn 1111dddd0100mmmm"),
    plain("UQSUB8", "111110101100nnnn 1111dddd0101mmmm"),
    plain("UHSUB8", "111110101100nnnn 1111dddd0110mmmm"),
    plain("SSUB16", "111110101101nnnn 1111dddd0000mmmm"),
    plain("QSUB16", "111110101101nnnn 1111dddd0001mmmm"),
    plain("SHSUB16", "111110101101nnnn 1111dddd0010mmmm"),
    plain("USUB16", "111110101101nnnn 1111dddd0100mmmm"),
    plain("UQSUB16", "111110101101nnnn 1111dddd0101mmmm"),
    plain("UHSUB16", "111110101101nnnn 1111dddd0110mmmm"),
    plain("SSAX", "111110101110nnnn 1111dddd0000mmmm"),
    plain("QSAX", "111110101110nnnn 1111dddd0001mmmm"),
    plain("SHSAX", "111110101110nnnn 1111dddd0010mmmm"),
    plain("USAX", "111110101110nnnn 1111dddd0100mmmm"),
    plain("UQSAX", "111110101110nnnn 1111dddd0101mmmm"),
    plain("UHSAX", "111110101110nnnn 1111dddd0110mmmm"),
    plain("QADD", "111110101000nnnn 1111dddd1000mmmm"),
    plain("QDADD", "111110101000nnnn 1111dddd1001mmmm"),
    plain("QSUB", "111110101000nnnn 1111dddd1010mmmm"),
    plain("QDSUB", "111110101000nnnn 1111dddd1011mmmm"),
    valid("REV (T2)", "111110101001nnnn 1111dddd1000mmmm", has_same_operands),
    valid("REV16 (T2)", "111110101001nnnn 1111dddd1001mmmm", has_same_operands),
    valid("RBIT", "111110101001nnnn 1111dddd1010mmmm", has_same_operands),
    valid("REVSH (T2)", "111110101001nnnn 1111dddd1011mmmm", has_same_operands),
    plain("SEL", "111110101010nnnn 1111dddd1000mmmm"),
    valid("CLZ", "111110101011nnnn 1111dddd1000mmmm", has_same_operands),
    // Multiplication and division.
    plain("MUL (T2)", "111110110000nnnn 1111dddd0000mmmm"),
    plain("MLA", "111110110000nnnn aaaadddd0000mmmm"),
    plain("MLS", "111110110000nnnn aaaadddd0001mmmm"),
    plain("SMULxy", "111110110001nnnn 1111dddd00wwmmmm"),
    plain("SMLAxy", "111110110001nnnn aaaadddd00wwmmmm"),
    plain("SMUAD", "111110110010nnnn 1111dddd000wmmmm"),
    plain("SMLAD", "111110110010nnnn aaaadddd000wmmmm"),
    plain("SMULWy", "111110110011nnnn 1111dddd000wmmmm"),
    plain("SMLAWy", "111110110011nnnn aaaadddd000wmmmm"),
    plain("SMUSD", "111110110100nnnn 1111dddd000wmmmm"),
    plain("SMLSD", "111110110100nnnn aaaadddd000wmmmm"),
    plain("SMMUL", "111110110101nnnn 1111dddd000wmmmm"),
    plain("SMMLA", "111110110101nnnn aaaadddd000wmmmm"),
    plain("SMMLS", "111110110110nnnn aaaadddd000wmmmm"),
    plain("USAD8", "111110110111nnnn 1111dddd0000mmmm"),
    plain("USADA8", "111110110111nnnn aaaadddd0000mmmm"),
    plain("SMULL", "111110111000nnnn eeeedddd0000mmmm"),
    plain("SDIV", "111110111001nnnn 1111dddd1111mmmm"),
    plain("UMULL", "111110111010nnnn eeeedddd0000mmmm"),
    plain("UDIV", "111110111011nnnn 1111dddd1111mmmm"),
    plain("SMLAL", "111110111100nnnn eeeedddd0000mmmm"),
    plain("SMLALxy", "111110111100nnnn eeeedddd10wwmmmm"),
    plain("SMLALD", "111110111100nnnn eeeedddd110wmmmm"),
    plain("SMLSLD", "111110111101nnnn eeeedddd110wmmmm"),
    plain("UMLAL", "111110111110nnnn eeeedddd0000mmmm"),
    plain("UMAAL", "111110111110nnnn eeeedddd0110mmmm"),
    // Special registers, hints, barriers.
    plain("MRS (APSR)", "1111001111101111 1000dddd00000000"),
    plain("MSR (APSR GE)", "111100111000nnnn 1000010000000000"),
    plain("MSR (APSR)", "111100111000nnnn 10001w0000000000"),
    plain("MRS (IPSR)", "1111001111101111 1000dddd00000101"),
    plain("MRS (CONTROL)", "1111001111101111 1000dddd00010100"),
    plain("MRS (MSP)", "1111001111101111 1000dddd00001000"),
    unit("MRS (PRIMASK, BASEPRI)", "1111001111101111 1000dddd0001000w", Unit::Mask),
    unit("MSR (PRIMASK, BASEPRI)", "111100111000nnnn 100010000001000w", Unit::Mask),
    excluded("MSR (other)", "111100111000ffff 1000ffffffffffff", "changes the stack or mode"),
    plain("NOP (T2)", "1111001110101111 1000000000000000"),
    plain("CLREX", "1111001110111111 1000111100101111"),
    plain("DSB", "1111001110111111 1000111101001111"),
    plain("DMB", "1111001110111111 1000111101011111"),
    unit("ISB", "1111001110111111 1000111101101111", Unit::Alone),
    // Branches.
    unit("BL", "11110iiiiiiiiiii 11w1wiiiiiiiiiii", Unit::Skip),
    unit("B (T4)", "11110iiiiiiiiiii 10w1wiiiiiiiiiii", Unit::Skip),
    excluded("UDF (T2)", "111101111111ffff 1010ffffffffffff", "faults, and a fault ends the program"),
    unit("B (cond, T3)", "11110scccciiiiii 10j0jiiiiiiiiiii", Unit::Skip),
    unit("TBB", "111010001101 1111 11110000 0000 xxxx", Unit::Table),
    unit("TBH", "111010001101 1111 11110000 0001 xxxx", Unit::Table),
];
