//! ROS 2's wire: topics over DDS, without an installation of ROS.

use std::io;
use std::net::{IpAddr, Ipv4Addr};

use anyhow::{Result, anyhow};
use beamfix::geometry::Pose;
use bytes::Bytes;
use host_tests::formats::ros::decoder::Layout;
use host_tests::formats::ros::message::Odometry;
use rustdds::no_key::{DataReader, DataWriter, Decode, DefaultDecoder};
use rustdds::no_key::{DeserializerAdapter, SerializerAdapter};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher, QosPolicies, QosPolicyBuilder,
    RTPSEntity, RepresentationIdentifier, Subscriber, Timestamp, TopicKind,
};

use crate::message::{Delivery, Message, TOPICS, dds_topic, dds_type};
use crate::node::{self, Ids, Participant};

/// What is not called as usual.
pub struct Names<'a> {
    /// Of the board's odometry.
    pub odom: &'a str,
    /// Of the wheels'.
    pub wheels: &'a str,
    /// Of the node.
    pub node: &'a str,
    /// How long ids are on ROS 2's wire.
    pub ids: Ids,
}

/// Writers of all topics, and the reader of the wheels.
pub struct Ros {
    writers: Vec<DataWriter<Vec<u8>, Cdr>>,
    wheels: DataReader<Vec<u8>, Cdr>,
    // Keeps what it said for who comes later.
    _node: DataWriter<Vec<u8>, Cdr>,
    // Behind what lives in them.
    _publisher: Publisher,
    _subscriber: Subscriber,
    _participant: DomainParticipant,
}

impl Ros {
    /// Joins a domain; on this computer alone, where that is wanted.
    pub fn join(domain: u16, is_local: bool, names: &Names) -> Result<Self> {
        let mut builder = DomainParticipantBuilder::new(domain);
        if is_local {
            builder = builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
        }
        let participant = builder
            .build()
            .map_err(|error| anyhow!("DDS domain {domain}: {error}"))?;
        let publisher = participant.create_publisher(&QosPolicies::default())?;
        let subscriber = participant.create_subscriber(&QosPolicies::default())?;
        let mut writers = Vec::new();
        for topic in &TOPICS {
            let name = match topic.name {
                "/odom" => names.odom,
                name => name,
            };
            let quality = quality(topic.delivery);
            let topic = participant.create_topic(
                dds_topic(name),
                dds_type(topic.kind),
                &quality,
                TopicKind::NoKey,
            )?;
            writers.push(publisher.create_datawriter_no_key(&topic, Some(quality))?);
        }
        let quality = quality(Delivery::BestEffort);
        let topic = participant.create_topic(
            dds_topic(names.wheels),
            dds_type("nav_msgs/msg/Odometry"),
            &quality,
            TopicKind::NoKey,
        )?;
        let wheels = subscriber.create_datareader_no_key(&topic, Some(quality))?;
        let quality = self::quality(Delivery::Latched);
        let topic = participant.create_topic(
            node::TOPIC.to_owned(),
            dds_type(node::KIND),
            &quality,
            TopicKind::NoKey,
        )?;
        let node: DataWriter<Vec<u8>, Cdr> =
            publisher.create_datawriter_no_key(&topic, Some(quality))?;
        let told = Participant {
            id: participant.guid().to_bytes(),
            node: names.node,
            readers: &[wheels.guid().to_bytes()],
            writers: &writers
                .iter()
                .map(|writer| writer.guid().to_bytes())
                .collect::<Vec<_>>(),
        };
        node.write(told.cdr(names.ids)?, Some(Timestamp::now()))
            .map_err(|error| anyhow!("{}: {error}", node::TOPIC))?;
        Ok(Self {
            writers,
            wheels,
            _node: node,
            _publisher: publisher,
            _subscriber: subscriber,
            _participant: participant,
        })
    }

    /// Publishes a message.
    pub fn publish(&self, message: &Message) -> Result<()> {
        let Some(writer) = self.writers.get(message.index()) else {
            return Ok(());
        };
        writer
            .write(message.cdr()?, Some(Timestamp::now()))
            .map_err(|error| anyhow!("{}: {error}", TOPICS[message.index()].name))
    }

    /// The next pose of the wheels, with its stamp (ns, 0 for none), if one has come; one that cannot be read is an error.
    pub fn wheels(&mut self) -> Result<Option<(i64, Pose)>> {
        let sample = self.wheels.take_next_sample();
        let Some(sample) = sample.map_err(|error| anyhow!("the wheels: {error}"))? else {
            return Ok(None);
        };
        let odometry = Odometry::read(sample.value(), Layout::Cdr)?;
        let stamp = &odometry.header;
        let ns = i64::from(stamp.sec) * 1_000_000_000 + i64::from(stamp.nanosec);
        let pose = odometry.pose;
        Ok(Some((
            ns,
            Pose::new(pose.x as f32, pose.y as f32, pose.theta as f32),
        )))
    }
}

/// As ROS 2's default profiles have it.
fn quality(delivery: Delivery) -> QosPolicies {
    let (reliability, durability, depth) = match delivery {
        Delivery::BestEffort => (Reliability::BestEffort, Durability::Volatile, 5),
        Delivery::Reliable => (reliable(), Durability::Volatile, 10),
        Delivery::Latched => (reliable(), Durability::TransientLocal, 1),
    };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
        .build()
}

fn reliable() -> Reliability {
    Reliability::Reliable {
        max_blocking_time: rustdds::Duration::from_millis(100),
    }
}

/// Messages that are CDR already: with the four bytes that say so where they are read, without where they are written.
struct Cdr;

impl SerializerAdapter<Vec<u8>> for Cdr {
    type Error = io::Error;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &Vec<u8>) -> io::Result<Bytes> {
        Ok(Bytes::copy_from_slice(value))
    }
}

impl DeserializerAdapter<Vec<u8>> for Cdr {
    type Error = io::Error;
    type Decoded = Vec<u8>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[
            RepresentationIdentifier::CDR_LE,
            RepresentationIdentifier::CDR_BE,
        ]
    }

    fn transform_decoded(decoded: Vec<u8>) -> Vec<u8> {
        decoded
    }
}

impl DefaultDecoder<Vec<u8>> for Cdr {
    type Decoder = Whole;
    const DECODER: Whole = Whole;
}

/// Takes a message as it is.
#[derive(Clone)]
struct Whole;

impl<'de> Decode<'de, Vec<u8>> for Whole {
    type Error = io::Error;

    fn decode_bytes(
        self,
        body: &'de [u8],
        encoding: RepresentationIdentifier,
    ) -> io::Result<Vec<u8>> {
        let is_little = encoding == RepresentationIdentifier::CDR_LE;
        let mut message = vec![0, u8::from(is_little), 0, 0];
        message.extend_from_slice(body);
        Ok(message)
    }
}
