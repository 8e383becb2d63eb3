//! Who comes to the port: connections that are looked at without waiting.

use super::packet::{PacketEvent, Receiver, frame_packet};
use crate::wire::keepalive;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// The other end of a connection.
pub trait Line: Send {
    /// Moves what has arrived into `buffer`: how many bytes, 0 for nothing now.
    ///
    /// # Errors
    /// The other end is gone.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize>;

    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// As [`Self::read`].
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Who is there, for messages.
    fn name(&self) -> String;
}

/// Where clients come in.
pub trait Port: Send {
    /// The next one, if one waits.
    ///
    /// # Errors
    /// No one will ever come.
    fn accept(&mut self) -> io::Result<Option<Box<dyn Line>>>;
}

/// A client that reads nothing for so long is gone.
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
        // Who broke off before being let in has not come.
        let Ok((stream, _)) = TcpListener::accept(self) else {
            return Ok(None);
        };
        stream.set_nonblocking(false)?;
        let socket = Socket::new(stream).ok();
        Ok(socket.map(|socket| Box::new(socket) as Box<dyn Line>))
    }
}

/// A client and what is agreed with it.
pub struct Client {
    line: Box<dyn Line>,
    receiver: Receiver,
    pending: VecDeque<u8>,
    /// Packets are acknowledged, until QStartNoAckMode.
    pub acknowledges: bool,
    /// Stop replies may say `swbreak`, `hwbreak`.
    pub knows_breaks: [bool; 2],
    /// Errors may be words.
    pub reads_words: bool,
    /// It let the core run and waits for the stop reply.
    pub waits: bool,
    /// Nothing more arrives.
    pub is_gone: bool,
    /// It detached, or killed, and may go: the core is no longer its own.
    pub has_left: bool,
    /// Sent last, should it be asked for again.
    last: Vec<u8>,
}

impl Client {
    /// Nothing is agreed yet.
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

    /// As [`Line::name`].
    pub fn name(&self) -> String {
        self.line.name()
    }

    /// The next thing that it said, if there is one; packets are acknowledged.
    ///
    /// # Errors
    /// It is gone.
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

    /// As [`Self::receive`], of the bytes fetched so far.
    ///
    /// # Errors
    /// It is gone.
    pub fn parse(&mut self) -> io::Result<Option<PacketEvent>> {
        while let Some(byte) = self.pending.pop_front() {
            match self.receiver.push(byte) {
                None => {}
                Some(PacketEvent::Again) => self.line.write(&self.last)?,
                // Without acknowledgements there is none of the opposite either.
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

    /// Sends a packet with these contents. A line that is broken shows when it is heard.
    pub fn send(&mut self, contents: &[u8]) {
        self.last = frame_packet(contents);
        let _ = self.line.write(&self.last);
    }
}
