//! The one place that knows burn's backends.

use std::fmt;
use std::str::FromStr;

use burn::tensor::Device;
use serde::{Deserialize, Serialize};

/// What computes the network's tensors in training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// burn-ndarray, on the CPU.
    #[default]
    Ndarray,
    /// burn-flex, its successor on the CPU.
    #[cfg(feature = "flex")]
    Flex,
    /// Any GPU that wgpu finds.
    #[cfg(feature = "wgpu")]
    Wgpu,
    /// The first CUDA device.
    #[cfg(feature = "cuda")]
    Cuda,
}

impl Backend {
    /// Those that this program was built with.
    pub const ALL: &'static [Backend] = &[
        Self::Ndarray,
        #[cfg(feature = "flex")]
        Self::Flex,
        #[cfg(feature = "wgpu")]
        Self::Wgpu,
        #[cfg(feature = "cuda")]
        Self::Cuda,
    ];

    /// Its name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ndarray => "ndarray",
            #[cfg(feature = "flex")]
            Self::Flex => "flex",
            #[cfg(feature = "wgpu")]
            Self::Wgpu => "wgpu",
            #[cfg(feature = "cuda")]
            Self::Cuda => "cuda",
        }
    }

    /// Its device.
    #[expect(deprecated, reason = "burn-ndarray is the default all the same; its successor is one flag away")]
    pub fn device(self) -> Device {
        match self {
            Self::Ndarray => Device::ndarray(),
            #[cfg(feature = "flex")]
            Self::Flex => Device::flex(),
            #[cfg(feature = "wgpu")]
            Self::Wgpu => Device::wgpu(burn::tensor::DeviceKind::DefaultDevice),
            #[cfg(feature = "cuda")]
            Self::Cuda => Device::cuda(0),
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Backend {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if let Some(&backend) = Self::ALL.iter().find(|backend| backend.name() == name) {
            return Ok(backend);
        }
        let built = Self::ALL.iter().map(|backend| backend.name()).collect::<Vec<_>>().join(", ");
        match name {
            "flex" | "wgpu" | "cuda" => {
                Err(format!("this program was built without it (it has {built}): build with --features {name}"))
            }
            _ => Err(format!("expected one of {built}; flex, wgpu and cuda are cargo features")),
        }
    }
}
