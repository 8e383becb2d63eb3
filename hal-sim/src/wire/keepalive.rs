//! Keep-alive probes that detect when the other end of a TCP socket has vanished.

use socket2::{SockRef, TcpKeepalive};
use std::io;
use std::net::TcpStream;
use std::time::Duration;

/// Idle time of a connection before the first probe: short enough for a host that waits for its
/// turn, and long enough to cost nothing.
pub const IDLE: Duration = Duration::from_secs(5);
/// Time between probes if there is no answer.
pub const INTERVAL: Duration = Duration::from_secs(2);
/// Number of unanswered probes after which the other end counts as lost. It is three, because a
/// network may lose one.
pub const QUESTIONS: u32 = 3;
/// Silence of the other end after which the connection is closed.
pub const PATIENCE: Duration = Duration::from_secs(5 + 3 * 2);

/// Enables keep-alive probes on `stream`. The system then ends the connection within about
/// [`PATIENCE`] after the other end's computer or cable has vanished, and reading and writing
/// report this; otherwise the connection would stay occupied forever. The system of a suspended
/// program still answers.
///
/// # Errors
/// Fails if the system rejects the options.
pub fn enable_keepalive(stream: &TcpStream) -> io::Result<()> {
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(IDLE).with_interval(INTERVAL);
    socket.set_tcp_keepalive(&keepalive.with_retries(QUESTIONS))?;
    // No probe is sent while bytes wait for acknowledgement: the system would resend them for a
    // quarter of an hour.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    socket.set_tcp_user_timeout(Some(PATIENCE))?;
    Ok(())
}

#[cfg(test)]
#[cfg(target_os = "linux")]
pub(crate) mod tests {
    use super::*;
    use std::net::{SocketAddr, TcpListener};

    /// Returns whether the system probes the only connection that was accepted at `address` of
    /// 127.0.0.1. The system's table shows this once no byte waits there.
    pub(crate) fn is_watched(address: SocketAddr) -> bool {
        let local = format!("0100007F:{:04X}", address.port());
        // A byte may still wait for acknowledgement.
        let looks = std::iter::repeat_with(|| timer(&local)).take(100);
        let mut waits = looks.inspect(|_| std::thread::sleep(Duration::from_millis(20)));
        waits.any(|timer| timer == "02")
    }

    /// Returns the timer of the connection with this local end from /proc/net/tcp. Its columns are
    /// the number, local and remote end, state (01: established), queues, and timer (02:
    /// keep-alive).
    fn timer(local: &str) -> String {
        let table = std::fs::read_to_string("/proc/net/tcp").unwrap();
        let rows = table.lines().map(|row| row.split_whitespace());
        let rows: Vec<Vec<&str>> = rows.map(Iterator::collect).collect();
        let mut own = rows.iter().filter(|row| row[1] == local && row[3] == "01");
        let timer = own.next().unwrap()[5][..2].to_owned();
        assert_eq!(own.next(), None, "{table}");
        timer
    }

    #[test]
    fn the_system_asks_and_gives_up_in_time() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        enable_keepalive(&stream).unwrap();
        let socket = SockRef::from(&stream);
        assert!(socket.keepalive().unwrap());
        let (idle, interval) = (
            socket.tcp_keepalive_time().unwrap(),
            socket.tcp_keepalive_interval().unwrap(),
        );
        let questions = socket.tcp_keepalive_retries().unwrap();
        assert_eq!(idle + questions * interval, PATIENCE);
        assert!(PATIENCE <= Duration::from_secs(15));
        assert_eq!(socket.tcp_user_timeout().unwrap(), Some(PATIENCE));
    }
}
