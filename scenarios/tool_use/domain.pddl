; Things on furniture, some of them out of reach; a tool can bring them closer.
(define (domain tool-use)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types
    surface - object
    item - surface)
  (:predicates
    (inhand ?i - item)
    (on ?i - item ?s - surface)
    (near ?s - surface)          ; the hand reaches it
    (tool ?i - item))            ; long enough to push with

  (:action pick
    :parameters (?i - item)
    :precondition (and
      (near ?i)
      (forall (?other - item) (and (not (inhand ?other)) (not (on ?other ?i)))))
    :effect (and
      (inhand ?i)
      (forall (?s - surface) (not (on ?i ?s)))))

  (:action place
    :parameters (?i - item ?s - surface)
    :precondition (and (inhand ?i) (near ?s) (not (= ?i ?s)))
    :effect (and (on ?i ?s) (not (inhand ?i))))

  (:action push
    :parameters (?t ?i - item ?s - surface)
    :precondition (and
      (tool ?t) (inhand ?t) (on ?i ?s) (near ?s)
      (not (= ?t ?i)) (not (= ?t ?s)) (not (= ?i ?s)))
    :effect (near ?i)))
