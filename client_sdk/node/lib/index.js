// SPDX-License-Identifier: Apache-2.0
'use strict';

const { connect, Client } = require('./client');
const { CarillonError, ServerUnavailable } = require('./errors');
const { ContactStream, Scene, SoundingObject } = require('./scenes');
const { Model } = require('./models');
const { Performance } = require('./performing');
const { Sound } = require('./sound');
const { Trace } = require('./traces');
const { defaultServer } = require('./address');

module.exports = {
  CarillonError, Client, ContactStream, Model, Performance, Scene, ServerUnavailable, Sound, SoundingObject, Trace,
  connect, defaultServer,
};
