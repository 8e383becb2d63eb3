//! FPv4-SP (Arm ARM A6).

use super::{Encoding, Form, Unit, memory, plain, unit, valid};

/// Returns whether the fixed-point number has at most as many fraction bits as its width.
const fn fits_fixed(w: u32) -> bool {
    w >> 7 & 1 != 0 || (w & 15) << 1 | w >> 5 & 1 <= 16
}

/// Returns whether the S register in the instruction is not S31: VMOV of two S registers also uses
/// the next one.
const fn has_successor(w: u32) -> bool {
    w & 0x2F != 0x2F
}

/// Floating-point encodings. The letter `f` marks the bits of an S register; the fifth bit of a D
/// register is fixed at zero, because only D0–D15 exist.
#[rustfmt::skip]
pub(super) const ENCODINGS: &[Encoding] = &[
    plain("VMLA", "111011100f00ffff ffff1010f0f0ffff"),
    plain("VMLS", "111011100f00ffff ffff1010f1f0ffff"),
    plain("VNMLS", "111011100f01ffff ffff1010f0f0ffff"),
    plain("VNMLA", "111011100f01ffff ffff1010f1f0ffff"),
    plain("VMUL", "111011100f10ffff ffff1010f0f0ffff"),
    plain("VNMUL", "111011100f10ffff ffff1010f1f0ffff"),
    plain("VADD", "111011100f11ffff ffff1010f0f0ffff"),
    plain("VSUB", "111011100f11ffff ffff1010f1f0ffff"),
    plain("VDIV", "111011101f00ffff ffff1010f0f0ffff"),
    plain("VFNMS", "111011101f01ffff ffff1010f0f0ffff"),
    plain("VFNMA", "111011101f01ffff ffff1010f1f0ffff"),
    plain("VFMA", "111011101f10ffff ffff1010f0f0ffff"),
    plain("VFMS", "111011101f10ffff ffff1010f1f0ffff"),
    plain("VMOV (imm)", "111011101f11ffff ffff10100000ffff"),
    plain("VMOV (reg)", "111011101f110000 ffff101001f0ffff"),
    plain("VABS", "111011101f110000 ffff101011f0ffff"),
    plain("VNEG", "111011101f110001 ffff101001f0ffff"),
    plain("VSQRT", "111011101f110001 ffff101011f0ffff"),
    plain("VCVTB, VCVTT (from half)", "111011101f110010 ffff1010w1f0ffff"),
    plain("VCVTB, VCVTT (to half)", "111011101f110011 ffff1010w1f0ffff"),
    plain("VCMP", "111011101f110100 ffff101001f0ffff"),
    plain("VCMPE", "111011101f110100 ffff101011f0ffff"),
    plain("VCMP (zero)", "111011101f110101 ffff101001000000"),
    plain("VCMPE (zero)", "111011101f110101 ffff101011000000"),
    plain("VCVT (from integer)", "111011101f111000 ffff1010w1f0ffff"),
    plain("VCVT (to integer)", "111011101f11110w ffff101011f0ffff"),
    plain("VCVTR (to integer)", "111011101f11110w ffff101001f0ffff"),
    valid("VCVT (from fixed)", "111011101f11101w ffff1010w1i0iiii", fits_fixed),
    valid("VCVT (to fixed)", "111011101f11111w ffff1010w1i0iiii", fits_fixed),
    plain("VMOV (core to S)", "111011100000ffff nnnn1010f0010000"),
    plain("VMOV (S to core)", "111011100001ffff dddd1010f0010000"),
    plain("VMOV (core to half of D)", "1110111000f0ffff nnnn101100010000"),
    plain("VMOV (half of D to core)", "1110111000f1ffff dddd101100010000"),
    valid("VMOV (two core to two S)", "111011000100mmmm nnnn101000f1ffff", has_successor),
    valid("VMOV (two S to two core)", "111011000101eeee dddd101000f1ffff", has_successor),
    plain("VMOV (two core to D)", "111011000100mmmm nnnn10110001ffff"),
    plain("VMOV (D to two core)", "111011000101eeee dddd10110001ffff"),
    plain("VMRS (APSR)", "1110111011110001 1111101000010000"),
    plain("VMRS", "1110111011110001 dddd101000010000"),
    plain("VMSR", "1110111011100001 nnnn101000010000"),
    memory("VLDR (literal, S)", "11101101wf011111 ffff1010iiiiiiii", Form::Literal, 4),
    memory("VLDR (literal, D)", "11101101w0011111 ffff1011iiiiiiii", Form::Literal, 8),
    memory("VSTR (SP, S)", "111011011f001101 ffff10100000kkkk", Form::Stack, 4),
    memory("VLDR (SP, S)", "111011011f011101 ffff10100000kkkk", Form::Stack, 4),
    memory("VSTR (SP, D)", "1110110110001101 ffff10110000kkkk", Form::Stack, 4),
    memory("VLDR (SP, D)", "1110110110011101 ffff10110000kkkk", Form::Stack, 4),
    memory("VSTR (S)", "11101101wf00bbbb ffff1010iiiiiiii", Form::Float, 4),
    memory("VLDR (S)", "11101101wf01bbbb ffff1010iiiiiiii", Form::Float, 4),
    memory("VSTR (D)", "11101101w000bbbb ffff1011iiiiiiii", Form::Float, 8),
    memory("VLDR (D)", "11101101w001bbbb ffff1011iiiiiiii", Form::Float, 8),
    unit("VPUSH (S)", "111011010f101101 ffff1010iiiiiiii", Unit::Stack),
    unit("VPUSH (D)", "1110110100101101 ffff1011iiiiiii0", Unit::Stack),
    unit("VPOP (S)", "111011001f111101 ffff1010iiiiiiii", Unit::Stack),
    unit("VPOP (D)", "1110110010111101 ffff1011iiiiiii0", Unit::Stack),
    memory("VSTMIA (S)", "111011001fw0bbbb ffff1010iiiiiiii", Form::FloatsUp, 0),
    memory("VLDMIA (S)", "111011001fw1bbbb ffff1010iiiiiiii", Form::FloatsUp, 0),
    memory("VSTMIA (D)", "1110110010w0bbbb ffff1011iiiiiii0", Form::FloatsUp, 0),
    memory("VLDMIA (D)", "1110110010w1bbbb ffff1011iiiiiii0", Form::FloatsUp, 0),
    memory("VSTMDB (S)", "111011010f10bbbb ffff1010iiiiiiii", Form::FloatsDown, 0),
    memory("VLDMDB (S)", "111011010f11bbbb ffff1010iiiiiiii", Form::FloatsDown, 0),
    memory("VSTMDB (D)", "111011010010bbbb ffff1011iiiiiii0", Form::FloatsDown, 0),
    memory("VLDMDB (D)", "111011010011bbbb ffff1011iiiiiii0", Form::FloatsDown, 0),
];
