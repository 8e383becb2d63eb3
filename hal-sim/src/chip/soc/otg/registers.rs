//! Offsets and bits of the OTG_FS registers (RM0090 section 34.16).

/// Offsets of the registers from the base of OTG_FS, 0x5000_0000.
pub mod offset {
    pub const GOTGCTL: u32 = 0x000;
    pub const GOTGINT: u32 = 0x004;
    pub const GAHBCFG: u32 = 0x008;
    pub const GUSBCFG: u32 = 0x00C;
    pub const GRSTCTL: u32 = 0x010;
    pub const GINTSTS: u32 = 0x014;
    pub const GINTMSK: u32 = 0x018;
    pub const GRXSTSR: u32 = 0x01C;
    pub const GRXSTSP: u32 = 0x020;
    pub const GRXFSIZ: u32 = 0x024;
    pub const DIEPTXF0: u32 = 0x028;
    pub const GCCFG: u32 = 0x038;
    pub const CID: u32 = 0x03C;
    pub const GHWCFG4: u32 = 0x050;
    pub const DIEPTXF1: u32 = 0x104;
    pub const DIEPTXF3: u32 = 0x10C;
    pub const DCFG: u32 = 0x800;
    pub const DCTL: u32 = 0x804;
    pub const DSTS: u32 = 0x808;
    pub const DIEPMSK: u32 = 0x810;
    pub const DOEPMSK: u32 = 0x814;
    pub const DAINT: u32 = 0x818;
    pub const DAINTMSK: u32 = 0x81C;
    pub const DIEPEMPMSK: u32 = 0x834;
    pub const IN_ENDPOINTS: u32 = 0x900;
    pub const OUT_ENDPOINTS: u32 = 0xB00;
    pub const PCGCCTL: u32 = 0xE00;
    pub const FIFO: u32 = 0x1000;
    pub const EP_CTL: u32 = 0x00; // Within the 0x20 bytes of an endpoint
    pub const EP_INT: u32 = 0x08;
    pub const EP_TSIZ: u32 = 0x10;
    pub const EP_DTXFSTS: u32 = 0x18;
}

/// Bits of the control and status register GOTGCTL.
pub mod otgctl {
    pub const CIDSTS: u32 = 1 << 16; // ID pin high: a B device
    pub const BSVLD: u32 = 1 << 19; // VBUS is valid for a B session
}

/// GOTGINT: end of session, VBUS was removed.
pub const SEDET: u32 = 1 << 2;

/// Bits of the AHB configuration register GAHBCFG.
pub mod ahbcfg {
    pub const GINT: u32 = 1; // Interrupts reach the NVIC
    pub const TXFELVL: u32 = 1 << 7; // TXFE means completely empty, not half empty
}

/// Bits of the USB configuration register GUSBCFG.
pub mod usbcfg {
    pub const PHSEL: u32 = 1 << 6; // Embedded PHY, always set
    pub const FHMOD: u32 = 1 << 29; // Force host mode
    /// Writable fields: TOCAL, SRPCAP, HNPCAP, TRDT, FDMOD.
    pub const WRITABLE: u32 = 0x7 | 0x3 << 8 | 0xF << 10 | 1 << 30;
    pub const RESET: u32 = 0x0000_0A00; // After reset (section 34.16.2)
}

/// Bits of the reset register GRSTCTL.
pub mod rstctl {
    pub const CSRST: u32 = 1;
    pub const RXFFLSH: u32 = 1 << 4;
    pub const TXFFLSH: u32 = 1 << 5;
    pub const TXFNUM: u32 = 0x1F << 6;
    pub const ALL: u32 = 0x10; // TXFNUM: all transmit FIFOs
    pub const AHBIDL: u32 = 1 << 31;
    pub const HOST: u32 = 0b110; // HSRST and FCRST
}

/// Bits of the interrupt registers GINTSTS and GINTMSK.
pub mod int {
    pub const OTGINT: u32 = 1 << 2;
    pub const SOF: u32 = 1 << 3;
    pub const RXFLVL: u32 = 1 << 4;
    pub const NPTXFE: u32 = 1 << 5;
    pub const GINAKEFF: u32 = 1 << 6;
    pub const GONAKEFF: u32 = 1 << 7;
    pub const ESUSP: u32 = 1 << 10;
    pub const USBSUSP: u32 = 1 << 11;
    pub const USBRST: u32 = 1 << 12;
    pub const ENUMDNE: u32 = 1 << 13;
    pub const EOPF: u32 = 1 << 15;
    pub const IEPINT: u32 = 1 << 18;
    pub const OEPINT: u32 = 1 << 19;
    pub const PTXFE: u32 = 1 << 26;
    pub const SRQINT: u32 = 1 << 30;
    pub const WKUPINT: u32 = 1 << 31;
    /// Bits set by an event and cleared by writing 1.
    pub const STICKY: u32 = SOF | ESUSP | USBSUSP | USBRST | ENUMDNE | EOPF | SRQINT | WKUPINT;
    /// Bits of host mode and isochronous transfers: NPTXFE, ISOODRP, IISOIXFR, IPXFR, HPRTINT,
    /// HCINT, PTXFE, DISCINT.
    pub const UNMODELLED: u32 =
        NPTXFE | 1 << 14 | 1 << 20 | 1 << 21 | 1 << 24 | 1 << 25 | PTXFE | 1 << 29;
    /// Interrupts on a mode mismatch and on a change of the ID pin, which never occur here.
    pub const NEVER: u32 = 1 << 1 | 1 << 28;
    /// Bits of GINTMSK that can be set.
    pub const MASKABLE: u32 =
        STICKY | NEVER | OTGINT | RXFLVL | GINAKEFF | GONAKEFF | IEPINT | OEPINT;
}

/// Bits of the general core configuration register GCCFG.
pub mod ccfg {
    pub const PWRDWN: u32 = 1 << 16; // Transceiver on (the name is its inverse)
    pub const VBUSASEN: u32 = 1 << 18; // VBUS sensing of an A device
    pub const VBUSBSEN: u32 = 1 << 19; // VBUS sensing of a B device
    pub const SOFOUTEN: u32 = 1 << 20; // Frame pulse on a pin
    pub const NOVBUSSENS: u32 = 1 << 21; // VBUS is assumed to be valid
}

/// Bits of the device configuration register DCFG.
pub mod dcfg {
    pub const DSPD: u32 = 0b11;
    pub const PFIVL: u32 = 0b11 << 11;
    pub const WRITABLE: u32 = 0x07F7; // NZLSOHSK, DAD, DSPD
    pub const RESET: u32 = 0x0220_0000;
}

/// Bits of the device control register DCTL.
pub mod dctl {
    pub const SDIS: u32 = 1 << 1;
    pub const GINSTS: u32 = 1 << 2;
    pub const GONSTS: u32 = 1 << 3;
    pub const SGINAK: u32 = 1 << 7;
    pub const CGINAK: u32 = 1 << 8;
    pub const SGONAK: u32 = 1 << 9;
    pub const CGONAK: u32 = 1 << 10;
    pub const POPRGDNE: u32 = 1 << 11;
    pub const UNMODELLED: u32 = 1 | 0b111 << 4; // Remote wake-up and test modes
}

/// Bits of the device status register DSTS.
pub mod dsts {
    pub const SUSPSTS: u32 = 1;
    pub const FULL_SPEED: u32 = 0b11 << 1; // ENUMSPD: full speed
}

/// Bits of the endpoint control registers DIEPCTLn and DOEPCTLn.
pub mod ctl {
    pub const MPSIZ: u32 = 0x7FF;
    pub const USBAEP: u32 = 1 << 15;
    pub const DPID: u32 = 1 << 16;
    pub const NAKSTS: u32 = 1 << 17;
    pub const EPTYP: u32 = 0b11 << 18;
    pub const ISOCHRONOUS: u32 = 0b01 << 18;
    pub const SNPM: u32 = 1 << 20; // Snoop mode, OUT only
    pub const STALL: u32 = 1 << 21;
    pub const TXFNUM: u32 = 0xF << 22;
    pub const CNAK: u32 = 1 << 26;
    pub const SNAK: u32 = 1 << 27;
    pub const SD0PID: u32 = 1 << 28;
    pub const SD1PID: u32 = 1 << 29;
    pub const EPDIS: u32 = 1 << 30;
    pub const EPENA: u32 = 1 << 31;
}

/// Bits of the endpoint interrupt registers DIEPINTn and DOEPINTn.
pub mod epint {
    pub const XFRC: u32 = 1;
    pub const EPDISD: u32 = 1 << 1;
    pub const STUP: u32 = 1 << 3; // OUT: SETUP phase done
    pub const INEPNE: u32 = 1 << 6; // IN: the NAK set by software is in effect
    pub const TXFE: u32 = 1 << 7; // IN: transmit FIFO empty, a level
}
