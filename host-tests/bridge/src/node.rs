//! The bridge as a node of ROS 2's graph.
//!
//! DDS knows participants, writers and readers, no nodes. What `ros2 node list` shows is said on a topic of its own: each
//! participant tells its nodes there, and by their ids the writers and readers of each.

use anyhow::{Result, ensure};
use host_tests::report::ros::cdr;
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Name of the topic in DDS: it is mangled by no rule.
pub const TOPIC: &str = "ros_discovery_info";
/// Type of its messages, as ROS 2 writes it.
pub const KIND: &str = "rmw_dds_common/msg/ParticipantEntitiesInfo";

/// Bytes of an id in DDS.
pub type Id = [u8; 16];

/// How long ids are on the topic. The type has the same name in all distributions: whoever expects the other length reads
/// nonsense.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ids {
    /// 16 bytes: Iron and later.
    Short,
    /// 24 bytes, of which the last eight are zeros: Humble and before.
    Long,
}

impl Ids {
    /// Of a distribution, as `ROS_DISTRO` calls it.
    #[must_use]
    pub fn of(distribution: &str) -> Self {
        match distribution {
            "dashing" | "eloquent" | "foxy" | "galactic" | "humble" => Self::Long,
            _ => Self::Short,
        }
    }
}

/// Whether ROS 2 takes a name of a node: letters, digits and `_`, no digit first.
pub fn check(name: &str) -> Result<()> {
    let is_usual = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let starts = name.chars().next();
    ensure!(
        starts.is_some_and(|c| !c.is_ascii_digit()) && name.chars().all(is_usual),
        "{name:?} is no name of a node: letters, digits and _, no digit first"
    );
    Ok(())
}

/// A participant with a single node, in the root namespace.
#[derive(Debug, Clone, Copy)]
pub struct Participant<'a> {
    /// Of the participant.
    pub id: Id,
    /// Name of its node.
    pub node: &'a str,
    /// The node's readers.
    pub readers: &'a [Id],
    /// The node's writers.
    pub writers: &'a [Id],
}

impl Participant<'_> {
    /// The message that tells it, in little-endian CDR.
    pub fn cdr(&self, ids: Ids) -> Result<Vec<u8>> {
        match ids {
            Ids::Short => self.with_ids::<16>(),
            Ids::Long => self.with_ids::<24>(),
        }
    }

    fn with_ids<const N: usize>(&self) -> Result<Vec<u8>> {
        let all = |ids: &[Id]| ids.iter().map(|&id| Gid::<N>(id)).collect::<Vec<_>>();
        let node = ("/", self.node, all(self.readers), all(self.writers));
        cdr(&(Gid::<N>(self.id), [node].as_slice()))
    }
}

/// An id of N bytes, zeros behind it.
struct Gid<const N: usize>(Id);

impl<const N: usize> Serialize for Gid<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for k in 0..N {
            tuple.serialize_element(&self.0.get(k).copied().unwrap_or(0))?;
        }
        tuple.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_as_long_as_the_distribution_has_them() {
        let participant = Participant {
            id: [1; 16],
            node: "bridge",
            readers: &[],
            writers: &[[2; 16]],
        };
        let mut wanted = vec![1; 16];
        // One node; two texts with their zeros, the first filled up to four; no reader, one writer.
        wanted.extend(*b"\x01\0\0\0\x02\0\0\0/\0\0\0\x07\0\0\0bridge\0\0\0\0\0\0\x01\0\0\0");
        let mut long = wanted.clone();
        wanted.extend([2; 16]);
        long.splice(16..16, [0; 8]);
        long.extend([2; 16]);
        long.extend([0; 8]);
        assert_eq!(
            participant.cdr(Ids::of("jazzy")).expect("a message"),
            wanted
        );
        assert_eq!(participant.cdr(Ids::of("humble")).expect("a message"), long);
        assert_eq!(Ids::of(""), Ids::Short);
    }

    #[test]
    fn names_are_those_that_ros_2_takes() {
        for (name, is_good) in [
            ("beamfix", true),
            ("_b2", true),
            ("2b", false),
            ("a/b", false),
            ("", false),
        ] {
            assert_eq!(check(name).is_ok(), is_good, "{name}");
        }
    }
}
