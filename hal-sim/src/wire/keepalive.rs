//! Finding out that the other end of a socket has vanished.

use socket2::{SockRef, TcpKeepalive};
use std::io;
use std::net::TcpStream;
use std::time::Duration;

/// A connection on which nothing comes is asked for a sign of life after this time: soon
/// enough for whoever waits for the place, and rare enough to cost nothing.
pub const IDLE: Duration = Duration::from_secs(5);
/// From one question to the next, if there is no answer.
pub const INTERVAL: Duration = Duration::from_secs(2);
/// Unanswered questions after which the other end is gone. Three, since a network may lose
/// one.
pub const QUESTIONS: u32 = 3;
/// How long the other end may have been silent when it is given up.
pub const PATIENCE: Duration = Duration::from_secs(5 + 3 * 2);

/// Has the system end the connection, which reading and writing then report, within about
/// [`PATIENCE`] after the other end's computer or cable has gone without a word: otherwise it
/// would be taken for ever. A program that is suspended is not gone: its system answers.
///
/// # Errors
/// The system refuses.
pub fn enable_keepalive(stream: &TcpStream) -> io::Result<()> {
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(IDLE).with_interval(INTERVAL);
    socket.set_tcp_keepalive(&keepalive.with_retries(QUESTIONS))?;
    // No question is asked while bytes wait to be acknowledged: they would be sent again for
    // a quarter of an hour.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    socket.set_tcp_user_timeout(Some(PATIENCE))?;
    Ok(())
}

#[cfg(test)]
#[cfg(target_os = "linux")]
pub(crate) mod tests {
    use super::*;
    use std::net::{SocketAddr, TcpListener};

    /// Whether the system asks for signs of life on the one connection that was accepted at
    /// `address` of 127.0.0.1, as it says itself once no byte waits there.
    pub(crate) fn is_watched(address: SocketAddr) -> bool {
        let local = format!("0100007F:{:04X}", address.port());
        // A byte may still have to be acknowledged.
        let looks = std::iter::repeat_with(|| timer(&local)).take(100);
        let mut waits = looks.inspect(|_| std::thread::sleep(Duration::from_millis(20)));
        waits.any(|timer| timer == "02")
    }

    /// Of the connection with this local end, from a table whose columns are its number,
    /// local and remote end, state (01: established), queues, timer (02: keep-alive).
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
