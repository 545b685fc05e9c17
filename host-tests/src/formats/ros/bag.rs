//! ROS recordings as files: MCAP, SQLite and the folder that rosbag2 keeps them in, packed by file, chunk or message.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::decoder::Layout;
use super::message::Kind;
use crate::formats::bytes::{self, Content};

/// The first bytes of an MCAP file.
pub const MCAP: &[u8] = b"\x89MCAP0\r\n";
/// The first bytes of an SQLite file.
pub const SQLITE: &[u8] = b"SQLite format 3\0";
/// Name of the attachment in which `simulate` keeps the lidar's bytes.
pub const ATTACHMENT: &str = "lidar.rec";

/// Longest record of a file, unpacked (bytes): a laser scan of a million beams.
const MAX_RECORD: usize = 1 << 26;
/// Most bytes of messages that are kept.
const MAX_KEPT: usize = 1 << 30;

/// A topic whose messages are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// What its messages are.
    pub kind: Kind,
    /// How they are laid out.
    pub layout: Layout,
    /// How many there are.
    pub count: usize,
}

/// A message of one of [`Bag::topics`].
#[derive(Debug, Clone)]
pub struct Message {
    /// Its topic.
    pub topic: usize,
    /// When it was recorded (ns).
    pub time: u64,
    /// Its bytes.
    pub data: Vec<u8>,
}

/// What a recording holds of what is read.
#[derive(Debug, Default)]
pub struct Bag {
    /// Topics that are read.
    pub topics: Vec<Topic>,
    /// Their messages in the order of their times.
    pub messages: Vec<Message>,
    /// Names of the topics of other types.
    pub others: Vec<String>,
    /// The lidar's bytes, as `simulate` keeps them.
    pub attachment: Option<Vec<u8>>,
    /// Why the recording ends before it should.
    pub cut: Option<String>,
    kept: usize,
}

/// Whether a file that starts like this is read here.
#[must_use]
pub fn is_bag(start: &[u8]) -> bool {
    start.starts_with(MCAP) || start.starts_with(SQLITE)
}

/// Whether the parts of an MCAP record that state their own length end within it. To be asked first: whoever parses it makes room for
/// a part before looking whether it is there.
fn parts_fit(opcode: u8, record: &[u8]) -> bool {
    let (head, parts) = match opcode {
        // Name, encoding and text.
        op::SCHEMA => (2, 3),
        // Topic, encoding and a table.
        op::CHANNEL => (4, 3),
        // Name and type.
        op::ATTACHMENT => (16, 2),
        _ => return true,
    };
    let Some(mut rest) = record.get(head..) else {
        return false;
    };
    let mut last: &[u8] = &[];
    for _ in 0..parts {
        let Some((part, behind)) = part(rest) else {
            return false;
        };
        (last, rest) = (part, behind);
    }
    if opcode == op::CHANNEL {
        // The table is keys and values.
        while !last.is_empty() {
            let Some((_, behind)) = part(last) else {
                return false;
            };
            last = behind;
        }
    }
    true
}

/// Bytes behind their length (u32), and what is behind them.
fn part(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

impl Bag {
    /// Reads a file's content.
    #[must_use]
    pub fn of_file(content: Content) -> Self {
        let mut bag = Self::default();
        bag.take(content);
        bag.sort();
        bag
    }

    /// Reads the files of a folder in the order of their numbers.
    pub fn of_folder(folder: &Path) -> Result<Self> {
        let name = folder.display();
        let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
            .with_context(|| name.to_string())?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let plain = name.strip_suffix(".zstd").unwrap_or(&name);
                plain.ends_with(".mcap") || plain.ends_with(".db3")
            })
            .collect();
        ensure!(
            !files.is_empty(),
            "{name}: a folder without .mcap and .db3 files: not a ROS 2 bag"
        );
        files.sort_by_cached_key(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            // `drive_2.db3` before `drive_10.db3`.
            let digits = name.rsplit('_').next().unwrap_or_default();
            let end = digits.find(|c: char| !c.is_ascii_digit());
            let number: u64 = digits[..end.unwrap_or(0)].parse().unwrap_or(0);
            (number, name.into_owned())
        });
        let mut bag = Self::default();
        for file in files {
            match bytes::load(&file) {
                Ok(content) => bag.take(content),
                Err(error) => bag.ends(format!("{error:#}")),
            }
        }
        bag.sort();
        Ok(bag)
    }

    fn take(&mut self, content: Content) {
        let result = if content.bytes.starts_with(SQLITE) {
            self.take_sqlite(content.bytes)
        } else {
            self.take_mcap(&content.bytes)
        };
        if let Some(cut) = content.cut {
            self.ends(cut);
        } else if let Err(error) = result {
            let count = self.messages.len();
            self.ends(format!("after {count} messages that are read: {error:#}"));
        }
    }

    fn ends(&mut self, why: String) {
        self.cut.get_or_insert(why);
    }

    /// Files keep what came in together as it came in; several topics written by several threads may be out of order.
    fn sort(&mut self) {
        self.messages.sort_by_key(|message| message.time);
    }

    /// The number of a topic, or `None` where its messages are not read.
    fn topic(&mut self, name: &str, type_name: &str, layout: Option<Layout>) -> Option<usize> {
        let (Some(kind), Some(layout)) = (Kind::of(type_name, name), layout) else {
            self.others.push(name.to_owned());
            return None;
        };
        let known = self
            .topics
            .iter()
            .position(|topic| topic.name == name && topic.kind == kind && topic.layout == layout);
        Some(known.unwrap_or_else(|| {
            self.topics.push(Topic {
                name: name.to_owned(),
                kind,
                layout,
                count: 0,
            });
            self.topics.len() - 1
        }))
    }

    fn keep(&mut self, topic: usize, time: u64, data: &[u8]) -> Result<()> {
        let data = unpacked(data)?;
        self.kept += data.len();
        ensure!(
            self.kept <= MAX_KEPT,
            "more than {MAX_KEPT} bytes of messages"
        );
        self.topics[topic].count += 1;
        self.messages.push(Message { topic, time, data });
        Ok(())
    }

    /// Record by record, so that a file that breaks off inside a chunk gives what was before.
    fn take_mcap(&mut self, file: &[u8]) -> Result<()> {
        let options = LinearReaderOptions::default().with_record_length_limit(MAX_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        let mut rest = file;
        let mut schemas: HashMap<u16, String> = HashMap::new();
        let mut topics: HashMap<u16, Option<usize>> = HashMap::new();
        while let Some(event) = reader.next_event() {
            let (opcode, data) = match event? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let (now, later) = rest.split_at(wanted.min(rest.len()));
                    reader.insert(now.len()).copy_from_slice(now);
                    reader.notify_read(now.len());
                    rest = later;
                    continue;
                }
                LinearReadEvent::Record { opcode, data } => (opcode, data),
            };
            // What nobody reads here need not be whole either.
            if !matches!(
                opcode,
                op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT
            ) {
                continue;
            }
            ensure!(
                parts_fit(opcode, data),
                "a record's parts are longer than the record"
            );
            match mcap::parse_record(opcode, data)? {
                Record::Schema { header, .. } => {
                    schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) if !topics.contains_key(&channel.id) => {
                    let layout = match channel.message_encoding.as_str() {
                        "cdr" => Some(Layout::Cdr),
                        "ros1" => Some(Layout::Ros1),
                        _ => None,
                    };
                    let type_name = schemas.get(&channel.schema_id).map_or("", String::as_str);
                    let topic = self.topic(&channel.topic, type_name, layout);
                    topics.insert(channel.id, topic);
                }
                Record::Message { header, data } => {
                    if let Some(&Some(topic)) = topics.get(&header.channel_id) {
                        self.keep(topic, header.log_time, &data)?;
                    }
                }
                Record::Attachment { header, data, .. } if header.name == ATTACHMENT => {
                    self.attachment = Some(data.into_owned());
                }
                _ => {}
            }
        }
        Ok(())
    }

    #[cfg(target_family = "wasm")]
    fn take_sqlite(&mut self, _: Vec<u8>) -> Result<()> {
        bail!(
            "an SQLite file, which is not read in a browser: `ros2 bag convert` makes an MCAP file of it"
        )
    }

    /// rosbag2's tables: `topics(id, name, type, …)` and `messages(topic_id, timestamp, data)`.
    #[cfg(not(target_family = "wasm"))]
    fn take_sqlite(&mut self, mut file: Vec<u8>) -> Result<()> {
        // A database with a write-ahead log opens only beside it; what is in this file is whole without.
        if let Some(versions) = file.get_mut(18..20) {
            versions.fill(1);
        }
        let mut database = rusqlite::Connection::open_in_memory()?;
        database.deserialize_read_exact("main", &file[..], file.len(), true)?;
        let mut topics: HashMap<i64, usize> = HashMap::new();
        let mut statement = database
            .prepare("SELECT id, name, type, serialization_format FROM topics")
            .context("an SQLite file, but not a bag of rosbag2")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (name, type_name, format): (String, String, String) =
                (row.get(1)?, row.get(2)?, row.get(3)?);
            let layout = (format == "cdr").then_some(Layout::Cdr);
            if let Some(topic) = self.topic(&name, &type_name, layout) {
                topics.insert(row.get(0)?, topic);
            }
        }
        let mut statement =
            database.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY id")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let Some(&topic) = topics.get(&row.get(0)?) else {
                continue;
            };
            let time: i64 = row.get(1)?;
            let data = row.get_ref(2)?;
            let data = data.as_blob().map_err(|error| anyhow::anyhow!("{error}"))?;
            self.keep(topic, time.unsigned_abs(), data)?;
        }
        Ok(())
    }
}

/// A message that was packed by itself is a zstd frame: CDR never starts with its first bytes.
fn unpacked(data: &[u8]) -> Result<Vec<u8>> {
    if !data.starts_with(&bytes::ZSTD) {
        return Ok(data.to_vec());
    }
    let mut message = Vec::new();
    let most = MAX_RECORD as u64;
    bytes::unzstd(data)?
        .take(most + 1)
        .read_to_end(&mut message)
        .context("a packed message")?;
    if message.len() as u64 > most {
        bail!("a message of more than {most} bytes");
    }
    Ok(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel with a topic, an encoding and a table of one pair.
    fn channel() -> Vec<u8> {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
        let pair = [text("key"), text("value")].concat();
        let table = [&(pair.len() as u32).to_le_bytes()[..], &pair].concat();
        [vec![1, 0, 2, 0], text("/scan"), text("cdr"), table].concat()
    }

    #[test]
    fn a_part_that_is_longer_than_its_record_is_seen() {
        let whole = channel();
        assert!(parts_fit(op::CHANNEL, &whole));
        // The lengths of topic, encoding, table, key and value, each one more than there is room for.
        for at in [4, 13, 20, 24, 31] {
            let mut longer = whole.clone();
            longer[at] += whole.len() as u8;
            assert!(!parts_fit(op::CHANNEL, &longer), "{at}");
        }
        for end in 0..whole.len() {
            assert!(!parts_fit(op::CHANNEL, &whole[..end]), "{end}");
        }
        assert!(parts_fit(op::MESSAGE, &[]));
    }
}
