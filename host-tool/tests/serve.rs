//! `flexor serve` lets a client in only when it can answer.

use crate::program::flexor;
use host_core::link::{Client, TcpPort};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Building the image and booting it take no longer.
const PATIENCE: Duration = Duration::from_secs(600);

struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A client that knocks from the first moment on is answered as soon as it is
/// let in: the chip has booted by then.
#[test]
fn the_first_connection_is_answered() {
    for device in ["native", "chip"] {
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let at = free.local_addr().unwrap().to_string();
        drop(free);
        let mut command = flexor(Path::new("."), &["serve", "--device", device, "--tcp", &at]);
        command.stdout(Stdio::null());
        let mut served = Served(command.spawn().unwrap());
        let begin = Instant::now();
        let mut refused = 0;
        let port = loop {
            match TcpPort::connect(&at) {
                Ok(port) => break port,
                Err(_) => refused += 1,
            }
            assert!(begin.elapsed() < PATIENCE, "{device} was never served");
            assert!(served.0.try_wait().unwrap().is_none(), "{device} ended");
            std::thread::sleep(Duration::from_millis(1));
        };
        let waited = begin.elapsed();
        // `Hello` is waited for half a second.
        let opened = Client::open(port);
        assert!(opened.is_ok(), "{device}: {:?}", opened.err());
        println!("{device}: refused {refused} times in {waited:?}, then answered");
    }
}
