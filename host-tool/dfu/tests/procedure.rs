//! Full runs, refused inputs and misbehaving devices.

use crate::fixture::{Contents, chip, classify, firmware, image, run};
use dfu::chip::{Chip, STM32F405};
use dfu::container::Segment;
use dfu::flash::{
    AlternateSetting, ChipState, Ending, Finish, FlashError, Image, ImageError, Progress, Stage,
    check_descriptor, flash, flash_until, select_setting,
};
use dfu::protocol::{
    FunctionalDescriptor, ProtocolError, Request, Session, Status, Transport, TransportError,
};
use dfu::simulated::{ExitKind, Fault, PollReport, SETTINGS, Simulated};
use std::cell::Cell;

#[test]
fn a_full_write_is_verified_and_keeps_everything_else() {
    for length in [400, 2_048, 16_384, 16_388, 65_536, 300_001, 0xC_0000] {
        let (mut device, clock) = chip(&firmware(700_000, 1));
        device
            .memory
            .preset(0x080A_0000, b"kept unless the image needs the sector");
        let before = device.memory.bytes().to_vec();
        let new = image(&firmware(length, 2));
        let (device, result) = run(device, &clock, &new, Finish::Stay);
        let report = result.unwrap();
        assert_eq!(classify(&device, &before, &new), Contents::New);
        assert_eq!(report.ending, Ending::InBootLoader);
        assert_eq!(report.transfers, device.transfers);
        let sectors: Vec<_> = report.sectors.iter().map(|sector| sector.address).collect();
        assert_eq!(
            device.erased, sectors,
            "each sector is erased once, sector 0 first"
        );
        let last = report.sectors.last().unwrap();
        let kept = (last.end() - STM32F405.origin) as usize;
        assert_eq!(device.memory.bytes()[kept..], before[kept..]);
        let [head, tail] = [0..3, device.written.len() - 3..device.written.len()];
        let [reset, pointer] = [(0x0800_0004, 4), (0x0800_0000, 4)];
        assert_eq!(device.written[head], [reset, pointer, reset]);
        assert_eq!(device.written[tail], [reset, pointer, pointer]);
        println!(
            "{length} bytes: {} sectors, {} transfers, {} ms",
            sectors.len(),
            report.transfers,
            clock.now_ms()
        );
    }
}

#[test]
fn the_last_allowed_byte_is_below_the_stage_table() {
    let new = image(&firmware(0xC_0000, 2));
    let numbers: Vec<_> = new.sectors().iter().map(|sector| sector.number).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    assert_eq!(new.blank_address(), None);
    let excess = Image::new(
        &STM32F405,
        &[Segment {
            address: STM32F405.origin,
            bytes: firmware(0xC_0001, 2),
        }],
    );
    let error = excess.unwrap_err();
    assert!(matches!(
        error,
        ImageError::TooLarge {
            last: 0x080C_0000,
            limit: 0x080B_FFFF,
            excess: 1
        }
    ));
}

#[test]
fn sessions_refuse_addresses_that_were_not_granted() {
    let (device, clock) = chip(&[]);
    let mut session = Session::new(device, clock, 2048, STM32F405.firmware());
    for result in [
        session.erase(0x080C_0000, 1000),
        session.erase(0x080E_0000, 1000),
        session.erase(0x1FFF_C000, 1000),
        session.write(0x080B_FFFF, &[0; 2]),
        session.write(0x080C_0000, &[0; 4]),
        session.write(0xFFFF_FFFF, &[0; 4]),
        session.write(0x07FF_FFFC, &[0; 4]),
    ] {
        assert!(
            matches!(result, Err(ProtocolError::Outside { .. })),
            "{result:?}"
        );
    }
    assert_eq!(session.transfers(), 0);
}

#[test]
fn progress_rises_to_the_total() {
    let (device, clock) = chip(&[]);
    let new = image(&firmware(100_000, 2));
    let mut session = Session::new(device, clock, 2048, STM32F405.firmware());
    let mut last: Vec<Progress> = Vec::new();
    flash(&mut session, &new, Finish::Stay, &mut |progress| {
        assert!(progress.done <= progress.total);
        match last.iter_mut().find(|seen| seen.stage == progress.stage) {
            Some(seen) => {
                assert!(progress.done > seen.done && progress.total == seen.total);
                *seen = progress;
            }
            None => last.push(progress),
        }
    })
    .unwrap();
    let stages: Vec<_> = last.iter().map(|progress| progress.stage).collect();
    assert_eq!(stages, [Stage::Erase, Stage::Write, Stage::Verify]);
    assert!(last.iter().all(|progress| progress.done == progress.total));
}

#[test]
fn both_meanings_of_the_block_number_and_short_poll_times_work() {
    for (by_length, poll) in [
        (true, PollReport::Exact),
        (false, PollReport::Fixed(0)),
        (true, PollReport::Fixed(100)),
        (false, PollReport::Fixed(60_000_000)),
    ] {
        let (mut device, clock) = chip(&firmware(50_000, 1));
        device.blocks_by_length = by_length;
        device.poll = poll;
        let before = device.memory.bytes().to_vec();
        let new = image(&firmware(150_001, 2));
        let (device, result) = run(device, &clock, &new, Finish::Stay);
        result.unwrap();
        assert_eq!(classify(&device, &before, &new), Contents::New);
    }
}

#[test]
fn leaving_resets_or_jumps() {
    for (finish, ending, left) in [
        (
            Finish::Jump,
            Ending::Jumped,
            Some(ExitKind::Jumped(0x0800_0000)),
        ),
        (Finish::Reset, Ending::ResetRequested, Some(ExitKind::Reset)),
        (Finish::Stay, Ending::InBootLoader, None),
    ] {
        let (device, clock) = chip(&[]);
        let (device, result) = run(device, &clock, &image(&firmware(5_000, 2)), finish);
        assert_eq!(result.unwrap().ending, ending);
        assert_eq!(device.left, left);
    }
    // An image that fills its last sector has no erased address for the reset.
    let (device, clock) = chip(&[]);
    let (device, result) = run(device, &clock, &image(&firmware(0x4000, 2)), Finish::Reset);
    assert_eq!(result.unwrap().ending, Ending::InBootLoader);
    assert_eq!(device.left, None);
}

#[test]
fn images_that_do_not_fit_are_named() {
    let new = |address, bytes: Vec<u8>| Image::new(&STM32F405, &[Segment { address, bytes }]);
    let good = firmware(5_000, 1);
    let with = |offset: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        new(0x0800_0000, bytes).unwrap_err()
    };
    assert_eq!(new(0x0800_0000, vec![]).unwrap_err(), ImageError::Empty);
    assert_eq!(Image::new(&STM32F405, &[]).unwrap_err(), ImageError::Empty);
    let short = new(0x0800_0000, good[..63].to_vec()).unwrap_err();
    assert_eq!(short, ImageError::TooShort { length: 63 });
    for origin in [0, 0x0801_0000, 0x07FF_FFFC, 0x2000_0000] {
        let error = new(origin, good.clone()).unwrap_err();
        assert!(matches!(error, ImageError::Origin { found, .. } if found == origin));
    }
    let large = new(0x0800_0000, vec![0; 2 << 20]).unwrap_err();
    assert!(matches!(large, ImageError::TooLarge { .. }));
    let stages = Image::new(
        &STM32F405,
        &[
            Segment {
                address: 0x0800_0000,
                bytes: good.clone(),
            },
            Segment {
                address: 0x080C_0000,
                bytes: vec![1],
            },
        ],
    );
    assert!(matches!(
        stages,
        Err(ImageError::TooLarge { excess: 1, .. })
    ));
    let twice = Image::new(
        &STM32F405,
        &[
            Segment {
                address: 0x0800_1000,
                bytes: vec![1; 8],
            },
            Segment {
                address: 0x0800_0000,
                bytes: good.clone(),
            },
        ],
    );
    assert_eq!(
        twice,
        Err(ImageError::Overlap {
            address: 0x0800_1000
        })
    );
    for pointer in [
        0,
        0xFFFF_FFFF,
        0x2000_0000,
        0x2002_0004,
        0x2000_1001,
        0x1000_0000,
    ] {
        assert!(matches!(with(0, pointer), ImageError::StackPointer { .. }));
    }
    for vector in [0, 0xFFFF_FFFF, 0x0800_0100, 0x0800_1389, 0x189, 0x2000_0101] {
        assert!(matches!(with(4, vector), ImageError::ResetVector { .. }));
    }
}

#[test]
fn the_setting_is_selected_by_its_layout() {
    let settings = |names: &[&str]| -> Vec<AlternateSetting> {
        let numbered = names.iter().zip(0..);
        numbered
            .map(|(name, number)| AlternateSetting {
                number,
                name: (*name).into(),
            })
            .collect()
    };
    let normal = settings(&SETTINGS);
    assert_eq!(select_setting(&STM32F405, &normal).unwrap().number, 0);
    let mut names = SETTINGS;
    names.reverse();
    assert_eq!(
        select_setting(&STM32F405, &settings(&names))
            .unwrap()
            .number,
        3
    );
    for other in [
        settings(&SETTINGS[1..]),
        settings(&["@Internal Flash  /0x08000000/04*016Kg,01*064Kg,03*128Kg"]),
        settings(&["", "@", "\u{0}"]),
        vec![],
    ] {
        let error = select_setting(&STM32F405, &other).unwrap_err();
        assert!(matches!(error, FlashError::OtherChip { .. }));
    }
    let smaller = Chip {
        groups: &[(4, 0x4000)],
        ..STM32F405
    };
    assert!(select_setting(&smaller, &normal).is_err());
}

#[test]
fn descriptors_are_checked() {
    let good = [9, 0x21, 0x0B, 0xFF, 0, 0, 8, 0x1A, 1];
    let parsed = FunctionalDescriptor::parse(&good).unwrap();
    assert_eq!(check_descriptor(&parsed), Ok(2048));
    for (index, value) in [(2, 0x0A), (2, 0x09), (5, 1), (6, 0), (6, 0x80), (7, 0)] {
        let mut bad = good;
        bad[index] = value;
        let parsed = FunctionalDescriptor::parse(&bad).unwrap();
        assert!(matches!(
            check_descriptor(&parsed),
            Err(FlashError::Unsupported { .. })
        ));
    }
    for bad in [&good[..8], &[8, 0x21, 0, 0, 0, 0, 0, 0, 0], &[]] {
        assert_eq!(FunctionalDescriptor::parse(bad), None);
    }
}

#[test]
fn read_protection_is_recognised_and_kept() {
    let (mut device, clock) = chip(&firmware(5_000, 1));
    device.read_protected = true;
    let before = device.memory.bytes().to_vec();
    let new = image(&firmware(5_000, 2));
    let (device, result) = run(device, &clock, &new, Finish::Stay);
    let failure = result.unwrap_err();
    assert!(matches!(
        failure.error,
        FlashError::ReadProtected {
            status: Status::VENDOR,
            ..
        }
    ));
    assert_eq!(failure.chip, ChipState::Unchanged);
    assert_eq!(classify(&device, &before, &new), Contents::Old);
    assert!(device.read_protected && device.erased.is_empty() && device.written.is_empty());
}

#[test]
fn write_protection_is_recognised() {
    let (mut device, clock) = chip(&firmware(5_000, 1));
    device.memory.write_protected = vec![0];
    let before = device.memory.bytes().to_vec();
    let (device, result) = run(device, &clock, &image(&firmware(5_000, 2)), Finish::Stay);
    let error = result.unwrap_err().error;
    assert!(
        matches!(
            error,
            FlashError::Mismatch {
                address: 0x0800_0004,
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(device.memory.bytes(), before);
    assert!(device.erased.is_empty());
    let (mut device, clock) = chip(&firmware(50_000, 1));
    device.memory.write_protected = vec![2];
    let (device, result) = run(device, &clock, &image(&firmware(50_000, 2)), Finish::Stay);
    let failure = result.unwrap_err();
    assert!(matches!(
        failure.error,
        FlashError::Mismatch {
            address: 0x0800_8000,
            ..
        }
    ));
    assert_eq!(failure.chip, ChipState::Unbootable);
    assert_eq!(
        device.memory.bytes()[..16],
        [0xFF; 16],
        "sector 0 stays erased"
    );
}

/// Every fault from every transfer on ends with an error or with a correct image, and flash keeps
/// the rules.
#[test]
fn every_fault_from_every_transfer_on() {
    let faults = [
        Fault::Stall,
        Fault::Silence,
        Fault::ShortAnswer,
        Fault::LongAnswer,
        Fault::Report(Status::PROGRAM),
        Fault::Report(Status(0x77)),
        Fault::ReportState(2),
        Fault::ReportState(8),
        Fault::ReportState(255),
        Fault::Busy(0),
        Fault::Busy(100),
        Fault::Busy(0x00FF_FFFF),
        Fault::FlipBit,
        Fault::IgnoreWrites,
        Fault::IgnoreErase,
        Fault::OtherSetting,
        Fault::Disconnect,
    ];
    let prepared = chip(&firmware(20_000, 1));
    let new = image(&firmware(20_000, 2));
    let mut most = 0;
    let mut runs = 0;
    let transfers = {
        let (device, clock) = prepared.clone();
        run(device, &clock, &new, Finish::Stay).0.transfers
    };
    for fault in faults {
        for from in 0..transfers {
            let (mut device, clock) = prepared.clone();
            device.fault = Some((from, fault));
            let before = device.memory.bytes().to_vec();
            let (device, result) = run(device, &clock, &new, Finish::Stay);
            let contents = classify(&device, &before, &new);
            if let Ok(report) = result {
                assert_eq!(contents, Contents::New, "{fault:?} from {from}: {report:?}");
            }
            most = most.max(device.transfers);
            runs += 1;
        }
    }
    println!("{runs} runs with faults, at most {most} transfers, {transfers} without faults");
    // A device that is busy for ever is polled for at most 9 s, every 5 ms.
    assert!(most <= transfers + 1_810, "{most}");
}

fn failure_with(fault: Fault, from: u64) -> (FlashError, Simulated) {
    let (mut device, clock) = chip(&firmware(20_000, 1));
    device.fault = Some((from, fault));
    let (device, result) = run(device, &clock, &image(&firmware(20_000, 2)), Finish::Stay);
    (result.unwrap_err().error, device)
}

#[test]
fn faults_have_names() {
    let (error, _) = failure_with(Fault::Report(Status::PROGRAM), 60);
    assert!(error.to_string().contains("errPROG (0x06)"), "{error}");
    let (error, _) = failure_with(Fault::Busy(50), 60);
    assert!(
        matches!(error, FlashError::Protocol(ProtocolError::Timeout { .. })),
        "{error}"
    );
    let (error, _) = failure_with(Fault::Disconnect, 60);
    assert!(matches!(error, FlashError::Unplugged { .. }), "{error}");
    let (error, _) = failure_with(Fault::Silence, 60);
    let FlashError::Protocol(ProtocolError::Transfer { cause, .. }) = error else {
        panic!("{error}");
    };
    assert_eq!(cause, TransportError::Timeout);
    let (error, _) = failure_with(Fault::FlipBit, 60);
    assert!(matches!(error, FlashError::Mismatch { .. }), "{error}");
    let (error, _) = failure_with(Fault::OtherSetting, 25);
    assert!(error.to_string().contains("errTARGET (0x01)"), "{error}");
    let (error, device) = failure_with(Fault::IgnoreErase, 0);
    assert!(matches!(error, FlashError::NotErased { .. }), "{error}");
    assert_eq!(device.erased, [0x0800_0000], "no other sector is erased");
}

/// Another program was killed after it sent a command that the next status request would run.
#[test]
fn a_pending_command_of_another_program_is_dropped() {
    for command in [&[0x41_u8][..], &[0x92], &[0x41, 0, 0, 0x0C, 0x08]] {
        let (mut device, clock) = chip(&firmware(5_000, 1));
        let clear = device.control_out(Request::ClearStatus, 0, &[], 100);
        let left = device.control_out(Request::Download, 0, command, 100);
        assert_eq!((clear, left), (Ok(()), Ok(())));
        let before = device.memory.bytes().to_vec();
        let new = image(&firmware(5_000, 2));
        let (device, result) = run(device, &clock, &new, Finish::Stay);
        result.unwrap();
        assert_eq!(classify(&device, &before, &new), Contents::New);
    }
}

/// An operation ends in time on a device that stays busy and answers slowly.
#[test]
fn the_time_of_answers_counts_in_the_limits() {
    for (poll_ms, latency_ms) in [(0, 500), (0, 0), (0, 4_900), (100, 4_900), (9_000, 4_999)] {
        let fault = |from| {
            let (mut device, clock) = chip(&firmware(20_000, 1));
            device.fault = Some((from, Fault::Busy(poll_ms)));
            device.latency_ms = latency_ms;
            let size = device.transfer_size();
            (
                Session::new(device, clock.clone(), size, STM32F405.firmware()),
                clock,
            )
        };
        // Four transfers bring the boot loader from the error of its start to dfuIDLE.
        let (mut session, clock) = fault(4);
        session.make_idle().unwrap();
        let begin = clock.now_ms();
        let result = session.erase(0x0800_4000, 2_600);
        let spent = clock.now_ms() - begin;
        assert!(
            matches!(
                result,
                Err(ProtocolError::Timeout {
                    limit_ms: 2_600,
                    ..
                })
            ),
            "{result:?}"
        );
        // The download and the last answer can each take 5 s.
        assert!((2_600..2_600 + 2 * 5_000).contains(&spent), "{spent} ms");
        let (mut session, clock) = fault(0);
        let result = session.make_idle();
        let spent = clock.now_ms();
        assert!((9_000..9_000 + 2 * 5_000).contains(&spent), "{spent} ms");
        assert!(
            matches!(
                result,
                Err(ProtocolError::Timeout {
                    limit_ms: 9_000,
                    ..
                })
            ),
            "{result:?}"
        );
    }
}

/// The procedure ends between two operations, wherever the signal comes, and a new run succeeds
/// without the buttons. While the vectors are committed it runs to its end.
#[test]
fn an_interruption_ends_between_two_operations() {
    let prepared = chip(&firmware(40_000, 1));
    let new = image(&firmware(40_000, 2));
    let before = prepared.0.memory.bytes().to_vec();
    let mut states = Vec::new();
    for moment in 0.. {
        let (device, clock) = prepared.clone();
        let size = device.transfer_size();
        let mut session = Session::new(device, clock.clone(), size, STM32F405.firmware());
        let asked = Cell::new(0);
        let is_interrupted = || {
            asked.set(asked.get() + 1);
            asked.get() > moment
        };
        let result = flash_until(
            &mut session,
            &new,
            Finish::Stay,
            &mut |_| {},
            &is_interrupted,
        );
        let device = session.into_transport();
        let contents = classify(&device, &before, &new);
        let Err(failure) = result else {
            assert_eq!((contents, asked.get()), (Contents::New, moment));
            break;
        };
        assert_eq!(failure.error, FlashError::Interrupted);
        match failure.chip {
            ChipState::Unchanged => assert_eq!(contents, Contents::Old),
            ChipState::Unbootable => assert_eq!(contents, Contents::Unbootable),
            other => panic!("{other:?}"),
        }
        states.push(failure.chip);
        // The same boot loader, without a restart.
        let (device, result) = run(device, &clock, &new, Finish::Stay);
        result.unwrap();
        assert_eq!(classify(&device, &before, &new), Contents::New);
    }
    println!("{} moments", states.len());
    assert_eq!(states[..2], [ChipState::Unchanged; 2]);
    // Erasing 2 sectors, writing 20 blocks, verifying 3 parts.
    assert!(states.len() >= 2 + 2 + 20 + 3, "{}", states.len());
}
