//! Replaces the core and executes the accesses of `board::stm32f405::tape`.

use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::soc::dma::{offset as dma, stream_offset};
use crate::chip::soc::gpio::{Edge, offset as gpio};
use crate::chip::soc::playback::{Block, Pace, Playback};
use crate::chip::soc::timer::offset as tim;
use crate::chip::soc::{Lanes, Ram};

pub const SRAM2: u32 = 0x2001_C000;
pub const LENGTH: u32 = 500;
pub const TAPE_B: u32 = SRAM2;
pub const TAPE_C: u32 = SRAM2 + 4 * LENGTH;
pub const ISOLATED: [u32; 2] = [TAPE_C + 4 * LENGTH, TAPE_C + 4 * LENGTH + 4];
pub const ISOLATED_B: u32 = 0xF3E3 << 16;
pub const ISOLATED_C: u32 = 0x03FF << 16;
/// Play B, play C, erase B, erase C.
pub const STREAMS: [usize; 4] = [5, 1, 2, 6];
pub const B: usize = 1;
pub const C: usize = 2;

pub struct Scene {
    pub playback: Playback,
    pub ram: Ram,
    /// Present cycle of the core.
    pub at: Cycle,
    pub edges: Vec<Edge>,
}

impl Scene {
    pub fn new(pace: Pace) -> Self {
        let mut scene = Self {
            playback: Playback::new(pace),
            ram: Ram::new(SRAM2, 16 * 1024),
            at: 1000,
            edges: Vec::new(),
        };
        let (playback, ram) = (&mut scene.playback, &mut scene.ram);
        playback.set_clocks(4, 2, 1000, ram).unwrap();
        scene
    }

    pub fn write(&mut self, block: Block, offset: u32, value: u32) {
        let wait = self
            .playback
            .write(block, offset, Lanes::whole(value), self.at, &mut self.ram)
            .unwrap();
        self.at += Cycle::from(wait) + 2;
    }

    pub fn read(&mut self, block: Block, offset: u32) -> u32 {
        let read = self
            .playback
            .read(block, offset, self.at, &mut self.ram)
            .unwrap();
        self.at += Cycle::from(read.wait) + 2;
        read.value
    }

    /// Returns a word of RAM, without an access.
    pub fn word(&self, address: u32) -> u32 {
        self.ram.read(address, Size::Word).unwrap()
    }

    pub fn set_word(&mut self, address: u32, value: u32) {
        self.ram.write(address, Size::Word, value).unwrap();
    }

    /// Sleeps until `to`, and wakes for every event.
    pub fn sleep(&mut self, to: Cycle) {
        loop {
            let next = self.playback.next_event().min(to);
            self.playback.advance(next, &mut self.ram).unwrap();
            if next == to {
                break;
            }
            assert!(self.playback.next_event() > next);
        }
        self.at = to;
        self.edges.append(&mut self.playback.gpio.edges);
    }

    pub fn tim1(&mut self, offset: u32, value: u32) {
        self.write(Block::Timer(1), offset, value);
    }

    pub fn tim2(&mut self, offset: u32, value: u32) {
        self.write(Block::Timer(2), offset, value);
    }

    pub fn ndtr(&mut self) -> [u32; 4] {
        STREAMS.map(|s| self.read(Block::Dma2, stream_offset(s, dma::NDTR)))
    }

    pub fn flags(&mut self) -> [u32; 2] {
        [dma::LISR, dma::HISR].map(|offset| self.read(Block::Dma2, offset))
    }

    /// Erases the tape.
    pub fn erase(&mut self) {
        for slot in 0..LENGTH {
            self.set_word(TAPE_B + 4 * slot, ISOLATED_B);
            self.set_word(TAPE_C + 4 * slot, ISOLATED_C);
        }
        self.set_word(ISOLATED[0], ISOLATED_B);
        self.set_word(ISOLATED[1], ISOLATED_C);
    }

    /// Does everything that `Tape::start` does except TIM1's CEN: makes B and C outputs, enables
    /// the four streams, which fetch slot 0, and configures both timers without starting them.
    /// Device time `first` begins with the first overflow; the first refill is 2 µs later.
    pub fn prepare(&mut self, first: u32) {
        let outputs = |lines: u32| (0..16).fold(0, |bits, n| bits | (lines >> n & 1) << (2 * n));
        self.write(Block::Gpio(B), gpio::MODER, outputs(0xF7E3));
        self.write(Block::Gpio(C), gpio::MODER, outputs(0x03FF));
        let [bsrr_b, bsrr_c] = [0x4002_0418, 0x4002_0818];
        self.stream(STREAMS[0], true, bsrr_b, TAPE_B);
        self.stream(STREAMS[1], true, bsrr_c, TAPE_C);
        self.stream(STREAMS[2], false, ISOLATED[0], TAPE_B);
        self.stream(STREAMS[3], false, ISOLATED[1], TAPE_C);
        self.prepare_tim1();
        self.prepare_tim2(first);
    }

    fn stream(&mut self, stream: usize, plays: bool, peripheral: u32, memory: u32) {
        let at = |register| stream_offset(stream, register);
        self.write(Block::Dma2, at(dma::PAR), peripheral);
        self.write(Block::Dma2, at(dma::M0AR), memory);
        self.write(Block::Dma2, at(dma::NDTR), LENGTH);
        self.write(Block::Dma2, at(dma::FCR), 0);
        let cr = 6 << 25 | 3 << 16 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8;
        let cr = cr | u32::from(plays) << 6;
        self.write(Block::Dma2, at(dma::CR), cr);
        self.write(Block::Dma2, at(dma::CR), cr | 1);
    }

    fn prepare_tim1(&mut self) {
        self.tim1(tim::CR1, 1 << 2);
        self.tim1(tim::PSC, 0);
        self.tim1(tim::ARR, 167);
        self.tim1(tim::RCR, 0);
        for (n, at) in [8, 20, 32, 84].into_iter().enumerate() {
            self.tim1(tim::CCR1 + 4 * n as u32, at);
        }
        self.tim1(tim::CCMR1, 0);
        self.tim1(tim::CCMR2, 6 << 12);
        self.tim1(tim::CR2, 7 << 4);
        self.tim1(tim::EGR, 1);
        self.tim1(tim::CNT, 160);
        self.tim1(tim::SR, 0);
        self.tim1(tim::DIER, 0xF << 8);
    }

    fn prepare_tim2(&mut self, first: u32) {
        self.tim2(tim::CR1, 1 << 2);
        self.tim2(tim::DIER, 0);
        self.tim2(tim::SMCR, 7);
        self.tim2(tim::PSC, 0);
        self.tim2(tim::ARR, u32::MAX);
        self.tim2(tim::CCMR1, 3 << 4 | 1);
        self.tim2(tim::CCMR2, 4 << 4);
        self.tim2(tim::CCER, 1);
        self.tim2(tim::CR2, 6 << 4);
        self.tim2(tim::EGR, 1);
        self.tim2(tim::CNT, first.wrapping_sub(1));
        self.tim2(tim::SR, 0);
        self.refill_at(first.wrapping_add(2));
        self.tim2(tim::DIER, 1 << 2);
        self.tim2(tim::CR1, 1 << 2 | 1);
    }

    pub fn refill_at(&mut self, at: u32) {
        self.tim2(tim::CCR1 + 4, at);
        self.tim2(tim::SR, !(1 << 2));
    }

    /// Starts TIM1 and returns the cycle of its first overflow. The counter, at 160, counts first
    /// two timer clocks after CEN and overflows with its eighth count.
    pub fn start(&mut self) -> Cycle {
        let before = self.at;
        let wait = self
            .playback
            .write(
                Block::Timer(1),
                tim::CR1,
                Lanes::whole(5),
                before,
                &mut self.ram,
            )
            .unwrap();
        let done = before + Cycle::from(wait) + 1;
        self.at = done + 1;
        done + 2 + 7
    }
}
