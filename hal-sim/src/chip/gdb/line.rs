//! Accepts connections at the port and reads from them without blocking.

use super::packet::{PacketEvent, Receiver, frame_packet};
use crate::wire::keepalive;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// A connection to a client, over which bytes travel in both directions.
pub trait Line: Send {
    /// Moves received bytes into `buffer`, and returns their number; 0 if there are none now.
    ///
    /// # Errors
    /// Fails if the other end has closed the connection.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize>;

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// Fails if the other end has closed the connection, or reads too slowly.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns the client's address, for messages.
    fn name(&self) -> String;
}

/// A port to which clients connect.
pub trait Port: Send {
    /// Returns the next waiting connection, if there is one.
    ///
    /// # Errors
    /// Fails if no client will ever connect again.
    fn accept(&mut self) -> io::Result<Option<Box<dyn Line>>>;
}

/// Longest time that a client may take to read an answer; after that, the connection counts as
/// lost.
const WRITE_PATIENCE: Duration = Duration::from_secs(5);

struct Socket(TcpStream);

impl Socket {
    fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_PATIENCE))?;
        keepalive::enable_keepalive(&stream)?;
        Ok(Self(stream))
    }
}

impl Line for Socket {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.set_nonblocking(true)?;
        let read = self.0.read(buffer);
        self.0.set_nonblocking(false)?;
        match read {
            Ok(0) => Err(io::ErrorKind::ConnectionReset.into()),
            Err(error) if is_transient(&error) => Ok(0),
            other => other,
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn name(&self) -> String {
        let peer = self.0.peer_addr();
        peer.map_or_else(|_| "an unknown address".to_owned(), |peer| peer.to_string())
    }
}

fn is_transient(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}

impl Port for TcpListener {
    fn accept(&mut self) -> io::Result<Option<Box<dyn Line>>> {
        self.set_nonblocking(true)?;
        // A connection that broke off before it was accepted is ignored.
        let Ok((stream, _)) = TcpListener::accept(self) else {
            return Ok(None);
        };
        stream.set_nonblocking(false)?;
        let socket = Socket::new(stream).ok();
        Ok(socket.map(|socket| Box::new(socket) as Box<dyn Line>))
    }
}

/// A connection to a client, with the features agreed on.
pub struct Client {
    line: Box<dyn Line>,
    receiver: Receiver,
    pending: VecDeque<u8>,
    /// Whether packets are acknowledged; the client can end that with QStartNoAckMode.
    pub acknowledges: bool,
    /// Whether stop replies may contain `swbreak` and `hwbreak`.
    pub knows_breaks: [bool; 2],
    /// Whether the client understands errors in words, not only in numbers.
    pub reads_words: bool,
    /// Whether the client let the core run and waits for the stop reply.
    pub waits: bool,
    /// Whether the connection is closed, so that nothing more will arrive.
    pub is_gone: bool,
    /// Whether the client detached or killed the program, so that another client may have the core.
    pub has_left: bool,
    /// Packet that was sent last, in case the client asks for it again.
    last: Vec<u8>,
}

impl Client {
    /// Creates a client without agreed features.
    pub fn new(line: Box<dyn Line>) -> Self {
        Self {
            line,
            receiver: Receiver::default(),
            pending: VecDeque::new(),
            acknowledges: true,
            knows_breaks: [false; 2],
            reads_words: false,
            waits: false,
            is_gone: false,
            has_left: false,
            last: Vec::new(),
        }
    }

    /// Returns the client's address for messages, as [`Line::name`] does.
    pub fn name(&self) -> String {
        self.line.name()
    }

    /// Returns the client's next event, if there is one, and acknowledges packets.
    ///
    /// # Errors
    /// Fails if the connection is closed.
    pub fn receive(&mut self) -> io::Result<Option<PacketEvent>> {
        loop {
            match self.parse()? {
                None if self.fetch() => {}
                None if self.is_gone => return Err(io::ErrorKind::ConnectionReset.into()),
                heard => return Ok(heard),
            }
        }
    }

    /// Fetches bytes that have arrived, and returns whether there were any.
    pub fn fetch(&mut self) -> bool {
        let mut buffer = [0; 4096];
        let read = self.line.read(&mut buffer);
        self.is_gone |= read.is_err();
        let count = read.unwrap_or(0);
        self.pending.extend(buffer.iter().take(count));
        count > 0
    }

    /// Returns the next event like [`Self::receive`], but only from bytes that have been fetched so
    /// far.
    ///
    /// # Errors
    /// Fails if the connection is closed.
    pub fn parse(&mut self) -> io::Result<Option<PacketEvent>> {
        while let Some(byte) = self.pending.pop_front() {
            match self.receiver.push(byte) {
                None => {}
                Some(PacketEvent::Again) => self.line.write(&self.last)?,
                // Without acknowledgements, the server does not ask for repetition either.
                Some(PacketEvent::Damaged) if self.acknowledges => self.line.write(b"-")?,
                Some(PacketEvent::Interrupt) => return Ok(Some(PacketEvent::Interrupt)),
                Some(heard) => {
                    if self.acknowledges {
                        self.line.write(b"+")?;
                    }
                    return Ok(Some(heard));
                }
            }
        }
        Ok(None)
    }

    /// Sends a packet with these contents. If the connection is broken, the next read fails.
    pub fn send(&mut self, contents: &[u8]) {
        self.last = frame_packet(contents);
        let _ = self.line.write(&self.last);
    }
}
