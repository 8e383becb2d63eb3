//! Edge files of random traces read back to the same edges and the same bytes.

use hal_sim::trace::{Levels, State, Trace, read_csv, write_csv};
use proptest::prelude::*;

fn trace() -> impl Strategy<Value = Trace> {
    let state = prop_oneof![
        Just(State::Isolated),
        Just(State::Anodic),
        Just(State::Cathodic),
        Just(State::Grounded)
    ];
    prop::collection::vec((0u64..1 << 34, 0u8..10, state, any::<u16>()), 0..40).prop_map(
        |mut steps| {
            steps.sort_by_key(|step| step.0);
            let (mut trace, mut levels) = (Trace::default(), Levels::ISOLATED);
            for (t_us, channel, state, code) in steps {
                levels = levels.with_channel(channel, state);
                trace.record_levels(t_us, levels);
                trace.record_dac(t_us, channel, code);
            }
            trace
        },
    )
}

proptest! {
    #[test]
    fn files_read_back(trace in trace()) {
        let edges: Vec<_> = trace.edges().collect();
        let mut bytes = Vec::new();
        write_csv(&mut bytes, trace.edges()).expect("a Vec takes all bytes");
        let read = read_csv(bytes.as_slice()).expect("own output");
        prop_assert_eq!(&read, &edges);
        let mut again = Vec::new();
        write_csv(&mut again, read).expect("a Vec takes all bytes");
        prop_assert_eq!(again, bytes);
        for channel in 0..10 {
            let states = trace.channel_edges(channel).map(|edge| edge.state);
            prop_assert!(states.collect::<Vec<_>>().windows(2).all(|pair| pair[0] != pair[1]));
        }
    }
}
