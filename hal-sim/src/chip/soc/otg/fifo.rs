//! Receive FIFO, which all OUT endpoints share, and transmit FIFO of one endpoint.

use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};
use std::collections::VecDeque;

/// Length of the FIFO memory in words (RM0090 section 34.10: 1.25 Kbyte).
pub const MEMORY_WORDS: u32 = 320;

/// Packet status of an entry of the receive FIFO (GRXSTSP.PKTSTS, device).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The global OUT NAK is in effect.
    GlobalNak = 1,
    /// An OUT data packet was received.
    Out = 2,
    /// An OUT transfer is complete.
    OutDone = 3,
    /// The SETUP stage of a control transfer is complete.
    SetupDone = 4,
    /// A SETUP packet was received.
    Setup = 6,
}

/// Status word that was removed from the receive FIFO, and its fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoppedEntry {
    /// GRXSTSP as read.
    pub word: u32,
    /// Number of the endpoint that received the packet.
    pub endpoint: usize,
    /// PKTSTS, a value of `Status`.
    pub status: u32,
}

/// Receive FIFO: status words, each followed by its packet's data.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Receive {
    words: VecDeque<u32>,
    /// Number of unread data words of the entry popped last.
    unread: usize,
}

impl Receive {
    /// Returns the number of words in the FIFO: status words and data.
    pub fn len(&self) -> usize {
        self.words.len()
    }

    /// Returns whether a status word waits (GINTSTS.RXFLVL).
    pub fn has_entry(&self) -> bool {
        self.words.len() > self.unread
    }

    /// Discards all entries (GRSTCTL.RXFFLSH).
    pub fn flush(&mut self) {
        self.words.clear();
        self.unread = 0;
    }

    /// Appends a status word for a packet of `endpoint` in `frame`, and the packet's `data`.
    pub fn push(&mut self, status: Status, endpoint: usize, data1: bool, frame: u16, data: &[u8]) {
        let pid = if data1 { 0b10 } else { 0b00 };
        self.words.push_back(
            (u32::from(frame) & 0xF) << 21
                | (status as u32) << 17
                | pid << 15
                | (data.len() as u32) << 4
                | endpoint as u32,
        );
        for chunk in data.chunks(4) {
            let mut word = [0; 4];
            for (to, from) in word.iter_mut().zip(chunk) {
                *to = *from;
            }
            self.words.push_back(u32::from_le_bytes(word));
        }
    }

    /// Returns the next status word without removing it (GRXSTSR).
    pub fn peek(&self) -> Modelled<u32> {
        refuse_if(
            self.unread > 0,
            "OTG_FS GRXSTSR read before the packet's data",
        )?;
        let word = self.words.front().copied();
        word.ok_or(Unmodelled("OTG_FS GRXSTSR read while the RX FIFO is empty"))
    }

    /// Removes and returns the next status word (GRXSTSP).
    pub fn pop(&mut self) -> Modelled<PoppedEntry> {
        refuse_if(
            self.unread > 0,
            "OTG_FS GRXSTSP read before the packet's data",
        )?;
        let word = self.words.pop_front();
        let word = word.ok_or(Unmodelled("OTG_FS GRXSTSP read while the RX FIFO is empty"))?;
        self.unread = (word >> 4 & 0x7FF).div_ceil(4) as usize;
        Ok(PoppedEntry {
            word,
            endpoint: (word & 0xF) as usize,
            status: word >> 17 & 0xF,
        })
    }

    /// Removes and returns the next data word (a read of any FIFO). Fails if the entry popped last
    /// has no data left.
    pub fn data(&mut self) -> Modelled<u32> {
        let empty = Unmodelled("OTG_FS FIFO read without data: pop GRXSTSP first");
        self.unread = self.unread.checked_sub(1).ok_or(empty)?;
        self.words.pop_front().ok_or(empty)
    }
}

/// Transmit FIFO of one IN endpoint.
#[derive(Clone, PartialEq, Debug)]
pub struct Transmit {
    words: VecDeque<u32>,
    /// Register DIEPTXFn: start and depth of the FIFO.
    pub(crate) register: u32,
}

impl Transmit {
    /// Creates an empty FIFO; `register` is the reset value of DIEPTXFn.
    pub fn new(register: u32) -> Self {
        Self {
            words: VecDeque::new(),
            register,
        }
    }

    /// Writes DIEPTXFn, which sets start and depth of the FIFO.
    pub fn configure(&mut self, value: u32) -> Modelled {
        let (start, depth) = (value & 0xFFFF, value >> 16);
        if depth < 16 || start + depth > MEMORY_WORDS {
            return Err(Unmodelled("OTG_FS DIEPTXFn beyond 320 words or under 16"));
        }
        self.register = value;
        Ok(())
    }

    fn depth(&self) -> usize {
        (self.register >> 16) as usize
    }

    /// Returns the number of free words (DTXFSTSn).
    pub fn free(&self) -> u32 {
        self.depth().saturating_sub(self.words.len()) as u32
    }

    /// Returns the number of words that wait to be sent to the host.
    pub fn len(&self) -> usize {
        self.words.len()
    }

    /// Returns whether DIEPINTn.TXFE is set: the FIFO is completely empty or half empty, as
    /// `completely` selects.
    pub fn is_empty(&self, completely: bool) -> bool {
        self.words.len() <= if completely { 0 } else { self.depth() / 2 }
    }

    /// Appends a word; fails if the FIFO is full.
    pub fn push(&mut self, word: u32) -> Modelled {
        refuse_if(self.free() == 0, "OTG_FS write to a full TX FIFO")?;
        self.words.push_back(word);
        Ok(())
    }

    /// Copies the first bytes to `to`. They stay in the FIFO, because the host may ask for them
    /// again.
    pub fn copy(&self, to: &mut [u8]) {
        for (chunk, word) in to.chunks_mut(4).zip(&self.words) {
            for (to, from) in chunk.iter_mut().zip(word.to_le_bytes()) {
                *to = from;
            }
        }
    }

    /// Discards the words of `bytes` bytes, which the host has acknowledged.
    pub fn release(&mut self, bytes: u32) {
        let words = (bytes.div_ceil(4) as usize).min(self.words.len());
        self.words.drain(..words);
    }

    /// Discards all words (GRSTCTL.TXFFLSH).
    pub fn flush(&mut self) {
        self.words.clear();
    }
}
